// Which limits of a window its program carries, the bounds that they are at the nodes, and the rule
// by which they are put in: the same for every engine.
//
// Most windows keep all limits by themselves, and bounds that the solution keeps anyway only cost
// iterations. So a window is solved without them, and the kinds that its solution breaks are put
// in until none is broken. The problem being convex, the result is the optimum under all of them.
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
  // Also keeps b within its travel between nodes, by a margin at the nodes.
  bool position_between = false;

  bool operator==(const ActiveLimits&) const = default;
};

struct Interval {
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();

  [[nodiscard]] bool bounded() const;
};

// Of b, ḃ and b̈ at a node, in mm and s.
struct BaseBounds {
  Interval position;
  Interval velocity;
  Interval accel;
};

// At node k of the window. b and ḃ at a resting end are given, so bounds on them say nothing there.
[[nodiscard]] BaseBounds base_bounds(const AxisWindow& window, ActiveLimits active, std::size_t k);

// Where the base rests at node k, if it does.
[[nodiscard]] std::optional<double> resting_base_mm(const AxisWindow& window, std::size_t k);

// Which limits the trajectory breaks, between the nodes too.
[[nodiscard]] ActiveLimits broken(const dynamics::AxisTrajectory& base, const BaseLimits& limits,
                                  double period_s);

// The same with the window's limits at the nodes.
[[nodiscard]] ActiveLimits broken(const dynamics::AxisTrajectory& base, const AxisWindow& window);

// The limits in force, and those broken in spite of them. The travel between nodes only counts
// where the nodes keep it.
[[nodiscard]] ActiveLimits tightened(const ActiveLimits& active, const ActiveLimits& more);

// Solves by the rule above; iterations are those of all solves together.
[[nodiscard]] Result<AxisSolution> solve_within_limits(
    const AxisWindow& window,
    const std::function<Result<AxisSolution>(const ActiveLimits&)>& solve_with);

}  // namespace unflex::compensate
