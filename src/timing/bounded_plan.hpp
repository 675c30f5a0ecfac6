// Trapezoids along a path under limits of its own at every vertex and on every move.
#pragma once

#include <span>
#include <vector>

#include "unflex/core/xy.hpp"
#include "unflex/planner/planner.hpp"
#include "unflex/timing/timing.hpp"

namespace unflex::timing {

// The speed or acceleration of the motor that moves most, |x| + |y| if the axes share motors.
[[nodiscard]] inline double asked_of_motors(const XY& of_axes, bool shares_motors) {
  return shares_motors ? taxicab(of_axes) : largest_part(of_axes);
}

// vertex_speeds_mm_s: one more than moves; the first and the last are the speeds at the ends of the
// path.
[[nodiscard]] std::vector<planner::PlannedMove> bounded_plan(
    std::span<const planner::PlannedMove> path, std::span<const MoveBounds> bounds,
    std::span<const double> vertex_speeds_mm_s);

}  // namespace unflex::timing
