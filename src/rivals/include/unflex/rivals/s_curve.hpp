// The five-phase S-curve profile: acceleration rises and falls, then cruise, then deceleration
// rises and falls. It has no phase of constant acceleration. So of all profiles that take the same
// time, it needs the least jerk.
//
//   v₁, v₂, T   speeds at the ends of a ramp of the plan, and its duration       a = |v₂ − v₁|/T
//
// A ramp of the plan is replaced by one between the same speeds in the same time, hence over the
// same distance. Its acceleration rises linearly to 2a in the middle and falls again, with jerk
// 4a/T. To keep the plan's acceleration as the limit instead, plan with half of it first. The
// profile then peaks at a, and the print takes longer.
#pragma once

#include <vector>

#include "unflex/gcode/interpreter.hpp"
#include "unflex/planner/planner.hpp"
#include "unflex/rivals/axis_path.hpp"

namespace unflex::rivals {

[[nodiscard]] AxisPath s_curve(const std::vector<planner::PlannedMove>& moves, gcode::Axis axis);

}  // namespace unflex::rivals
