#include "step_ends.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace unflex::emit {
namespace {

// How many places off the best one, along the path, an end may lie.
constexpr int kAlong = 3;

// Whole numbers are held as doubles here: conversions would take most of the time.
class Chooser {
 public:
  Chooser(const Bowl& bowl, const Places& places, double room)
      : best_{bowl.best[0], bowl.best[1]},
        from_{static_cast<double>(places.from[0]), static_cast<double>(places.from[1])},
        places_(&places),
        room_(room) {
    const std::array<double, 2> steep = {bowl.xx, bowl.yy};
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const double other = steep[1 - axis];
      per_step_[axis] = -bowl.xy / other;
      along_[axis] = 0.5 * (steep[axis] + bowl.xy * per_step_[axis]);
      across_[axis] = 0.5 * other;
    }
  }

  // The best place among those with this many steps on one axis.
  void consider(std::size_t axis, double steps_there) {
    const double off = steps_there - best_[axis];
    const double other = best_[1 - axis] + per_step_[axis] * off;
    const double whole = nearest_whole(other);
    const double extra =
        along_[axis] * off * off + across_[axis] * (whole - other) * (whole - other);
    if (extra < room_) {
      Steps to{};
      to[axis] = steps_there;
      to[1 - axis] = whole;
      add(to, extra);
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
      if (other.at == end.at) {
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

  Steps best_;
  Steps from_;
  const Places* places_;
  double room_;
  // By the axis that is given: where the cheapest place is when it goes a step further, and what
  // the square of a step costs along that way, and beside it.
  std::array<double, 2> per_step_{};
  std::array<double, 2> along_{};
  std::array<double, 2> across_{};
  StepEnds found_;
};

}  // namespace

StepEnds cheapest_ends(const Bowl& bowl, const Places& places, double room) {
  Chooser chooser(bowl, places, room);
  const std::size_t along = bowl.xx < bowl.yy ? 0 : 1;
  const auto best = [&](std::size_t axis) {
    return nearest_whole(bowl.best[static_cast<Eigen::Index>(axis)]);
  };
  const double best_along = best(along);
  for (int d = -kAlong; d <= kAlong; ++d) {
    chooser.consider(along, best_along + d);
  }
  const double best_across = best(1 - along);
  for (int d = -1; d <= 1; ++d) {
    chooser.consider(1 - along, best_across + d);
  }
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
