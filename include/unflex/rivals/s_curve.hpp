// The five-phase S-curve profile: acceleration goes up and down again, cruise, and the same for the
// deceleration. No phase of constant acceleration, so of all profiles limited in jerk this has the
// least of it for its time.
//
//   v₁, v₂, T   speeds at the ends of a ramp of the plan, and its duration       a = |v₂ − v₁|/T
//
// A ramp of the plan is replaced by one from the same to the same speed in the same time, hence
// over the same distance: acceleration rises linearly to 2a in the middle and falls again, jerk
// 4a/T. With the plan's acceleration kept as the limit instead, plan with half of it first: the
// same profile then peaks at a and the print takes longer.
#pragma once

#include <vector>

#include "unflex/gcode/interpreter.hpp"
#include "unflex/planner/planner.hpp"
#include "unflex/rivals/axis_path.hpp"

namespace unflex::rivals {

[[nodiscard]] AxisPath s_curve(const std::vector<planner::PlannedMove>& moves, gcode::Axis axis);

}  // namespace unflex::rivals
