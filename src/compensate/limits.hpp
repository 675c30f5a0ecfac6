// The limits in the program of a window, their bounds at the nodes, and the rule by which limits
// are added. All engines share this.
//
// Most windows keep all limits by themselves, and bounds that the solution keeps anyway only cost
// iterations. So a window is first solved without limits. Then the kinds that its solution breaks
// are added, until none is broken. As the problem is convex, the result is the optimum under all
// limits.
#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <optional>

#include "unflex/compensate/axis_window.hpp"
#include "unflex/core/error.hpp"

namespace unflex::compensate {

struct ActiveLimits {
  bool velocity = false;
  bool accel = false;
  bool jerk = false;
  bool position = false;
  // Keeps b within its travel between nodes too, by a margin at the nodes.
  bool position_between = false;

  bool operator==(const ActiveLimits&) const = default;
};

struct Interval {
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();

  [[nodiscard]] bool bounded() const;
};

// Bounds of b, ḃ and b̈ at a node, in mm and s.
struct BaseBounds {
  Interval position;
  Interval velocity;
  Interval accel;
};

// The bounds at node k of the window. At a resting end b and ḃ are given, so bounds on them have no
// effect there.
[[nodiscard]] BaseBounds base_bounds(const AxisWindow& window, ActiveLimits active, std::size_t k);

// Where the base rests at node k, if it does.
[[nodiscard]] std::optional<double> resting_base_mm(const AxisWindow& window, std::size_t k);

// The limits that the trajectory breaks, at the nodes or between them.
[[nodiscard]] ActiveLimits broken(const dynamics::AxisTrajectory& base, const BaseLimits& limits,
                                  double period_s);

// The limits that the trajectory breaks, including the window's own limits at the nodes.
[[nodiscard]] ActiveLimits broken(const dynamics::AxisTrajectory& base, const AxisWindow& window);

// The limits in `active`, and those in `more`, which are broken in spite of them. Travel between
// nodes counts only where the nodes themselves keep the travel.
[[nodiscard]] ActiveLimits tightened(const ActiveLimits& active, const ActiveLimits& more);

// Solves by the rule above. `iterations` of the result is the sum over all solves.
[[nodiscard]] Result<AxisSolution> solve_within_limits(
    const AxisWindow& window,
    const std::function<Result<AxisSolution>(const ActiveLimits&)>& solve_with);

}  // namespace unflex::compensate
