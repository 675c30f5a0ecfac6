#include "step_ends.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace unflex::emit {
namespace {

// An end may lie this many places off the best one, along the path.
constexpr int kAlong = 3;

// Whole numbers are held as doubles here, since conversions would take most of the time.
class Chooser {
 public:
  Chooser(const Bowl& bowl, const Eigen::Vector2d& best, const Places& places, double room)
      : bowl_(&bowl),
        best_{best[0], best[1]},
        from_{static_cast<double>(places.from[0]), static_cast<double>(places.from[1])},
        places_(&places),
        room_(room) {}

  // Considers the best place among those with this many steps on one axis.
  void consider(std::size_t axis, double steps_there) {
    const double off = steps_there - best_[axis];
    const double other = best_[1 - axis] + bowl_->slant[axis] * off;
    const double whole = nearest_whole(other);
    const double extra =
        bowl_->along[axis] * off * off + bowl_->beside[axis] * (whole - other) * (whole - other);
    if (extra < room_) {
      Steps to{};
      to[axis] = steps_there;
      to[1 - axis] = whole;
      add(to, extra);
    }
  }
  // Considers those with up to `reach` steps more or less on one axis than the best place has.
  void consider_around(std::size_t axis, int reach) {
    const double middle = nearest_whole(best_[axis]);
    for (int d = -reach; d <= reach; ++d) {
      consider(axis, middle + d);
    }
  }

  [[nodiscard]] const StepEnds& found() const { return found_; }

 private:
  using Steps = std::array<double, 2>;

  void add(const Steps& to, double extra) {
    if (!there_is(to)) {
      return;
    }
    const StepEnd end{{static_cast<std::int64_t>(to[0]), static_cast<std::int64_t>(to[1])}, extra};
    for (const StepEnd& other : found_) {
      if (are_same(other.at, end.at)) {
        return;
      }
    }
    auto& [ends, count] = found_;
    count = std::min(count + 1, StepEnds::kMost);
    ends[count - 1] = end;
    for (std::size_t j = count - 1; j > 0 && ends[j].extra < ends[j - 1].extra; --j) {
      std::swap(ends[j], ends[j - 1]);
    }
    if (count == StepEnds::kMost) {
      room_ = ends[count - 1].extra;
    }
  }

  [[nodiscard]] bool there_is(const Steps& to) const {
    return (std::abs(to[0] - from_[0]) >= places_->min_steps ||
            std::abs(to[1] - from_[1]) >= places_->min_steps) &&
           to[0] >= places_->least[0] && to[0] <= places_->most[0] && to[1] >= places_->least[1] &&
           to[1] <= places_->most[1];
  }

  const Bowl* bowl_;
  Steps best_;
  Steps from_;
  const Places* places_;
  double room_;
  StepEnds found_;
};

}  // namespace

Bowl::Bowl(double xx, double xy, double yy)
    : flat(xx < yy ? 0 : 1),
      slant{-xy / yy, -xy / xx},
      along{0.5 * (xx + xy * slant[0]), 0.5 * (yy + xy * slant[1])},
      beside{0.5 * yy, 0.5 * xx} {}

StepEnds cheapest_ends(const Bowl& bowl, const Eigen::Vector2d& best, const Places& places,
                       double room) {
  Chooser chooser(bowl, best, places, room);
  chooser.consider_around(bowl.flat, kAlong);
  chooser.consider_around(1 - bowl.flat, 1);
  if (chooser.found().count < StepEnds::kMost && places.min_steps > 1) {
    for (const std::size_t axis : {0U, 1U}) {
      const auto from = static_cast<double>(places.from[axis]);
      chooser.consider(axis, from - places.min_steps);
      chooser.consider(axis, from + places.min_steps);
    }
  }
  return chooser.found();
}

}  // namespace unflex::emit
