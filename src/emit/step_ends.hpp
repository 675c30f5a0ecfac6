// Whole steps near a place.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "line_cost.hpp"
#include "vertices.hpp"

namespace unflex::emit {

using Place = std::array<std::int64_t, 2>;  // in steps

// Equivalent to a == b, which would call a function for these few bytes.
[[nodiscard]] inline bool are_same(const Place& a, const Place& b) {
  return a[0] == b[0] && a[1] == b[1];
}

// The nearest whole number, for |x| < 2^51. At the size of kNoFraction a double has no digits after
// the point, so adding it rounds x.
[[nodiscard]] inline double nearest_whole(double x) {
  constexpr double kNoFraction = 0x1.8p52;
  return (x + kNoFraction) - kNoFraction;
}

class StepGrid {
 public:
  explicit StepGrid(const Axes<AxisGrid>& grid)
      : step_mm_(of_axes(grid, &AxisGrid::step_mm)),
        offset_mm_(of_axes(grid, &AxisGrid::offset_mm)) {}

  [[nodiscard]] const Eigen::Vector2d& step_mm() const { return step_mm_; }
  [[nodiscard]] Eigen::Vector2d steps(const Eigen::Vector2d& mm) const {
    return (mm - offset_mm_).cwiseQuotient(step_mm_);
  }
  [[nodiscard]] Place nearest(const Eigen::Vector2d& mm) const {
    const Eigen::Vector2d at = steps(mm);
    return {static_cast<std::int64_t>(nearest_whole(at[0])),
            static_cast<std::int64_t>(nearest_whole(at[1]))};
  }
  [[nodiscard]] Eigen::Vector2d mm(const Place& at) const {
    return offset_mm_ + Eigen::Vector2d(static_cast<double>(at[0]), static_cast<double>(at[1]))
                            .cwiseProduct(step_mm_);
  }

 private:
  Eigen::Vector2d step_mm_;
  Eigen::Vector2d offset_mm_;
};

// The extra cost of a place over the best one: ½ (x, y) S (x, y)ᵀ, where (x, y) is the distance
// between the two in steps.
struct Bowl {
  Bowl() = default;
  Bowl(double xx, double xy, double yy);

  std::size_t flat = 0;  // the axis along which S is smaller
  // Indexed by the axis whose place is given. slant: how far the cheapest place on the other axis
  // moves per step on this one. along: the cost of a squared step on this axis if the other
  // follows. beside: the cost of a squared step of the other axis off its cheapest place.
  std::array<double, 2> slant{};
  std::array<double, 2> along{};
  std::array<double, 2> beside{};
};

// The places allowed: at least min_steps away from `from` on one axis, and between `least` and
// `most`.
struct Places {
  Place from{};
  int min_steps = 1;
  Eigen::Vector2d least = Eigen::Vector2d::Zero();  // in steps
  Eigen::Vector2d most = Eigen::Vector2d::Zero();

  [[nodiscard]] bool far_enough(const Place& to) const {
    return std::max(std::abs(to[0] - from[0]), std::abs(to[1] - from[1])) >= min_steps;
  }
};

struct StepEnd {
  Place at{};
  double extra = 0.0;
};

// The cheapest places around the best one, in steps. They are in order of cost, and all cost less
// than `room` extra.
struct StepEnds {
  static constexpr std::size_t kMost = 3;
  std::array<StepEnd, kMost> ends;
  std::size_t count = 0;

  [[nodiscard]] const StepEnd* begin() const { return ends.data(); }
  [[nodiscard]] const StepEnd* end() const { return ends.data() + count; }
};
[[nodiscard]] StepEnds cheapest_ends(const Bowl& bowl, const Eigen::Vector2d& best,
                                     const Places& places, double room);

}  // namespace unflex::emit
