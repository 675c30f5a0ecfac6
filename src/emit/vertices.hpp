// Where the lines of a run meet.
#pragma once

#include <vector>

#include "unflex/dynamics/base_trajectory.hpp"

namespace unflex::emit {

// BaseTrajectory::x_at or y_at.
using AxisAt = dynamics::AxisMotion (dynamics::BaseTrajectory::*)(double) const;

// One axis at the vertices. A chord lies inside a curve: between vertices on the curve it is off by
// b̈ T²/12 on average, which the nozzle follows. Vertices moved out so that the mean of the error
// against each one's hat function vanishes leave only an error too quick for the machine to follow.
// Where that would break the limit on the change of speed from line to line, the vertex stays on
// the curve; and none goes further out than the base, which may be at the end of its travel.
[[nodiscard]] std::vector<double> vertices(const dynamics::BaseTrajectory& base, AxisAt axis,
                                           const std::vector<double>& times,
                                           double max_accel_mm_s2);

}  // namespace unflex::emit
