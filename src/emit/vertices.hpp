// Where the lines of a run meet.
#pragma once

#include <vector>

#include "unflex/dynamics/base_trajectory.hpp"
#include "unflex/dynamics/flexible_axis.hpp"
#include "unflex/emit/emitter.hpp"

namespace unflex::emit {

// BaseTrajectory::x_at or y_at.
using AxisAt = dynamics::AxisMotion (dynamics::BaseTrajectory::*)(double) const;

// Places that a vertex of one axis can have: offset + integer · step.
struct AxisGrid {
  double offset_mm = 0.0;
  double step_mm = 1e-4;

  [[nodiscard]] double nearest(double position_mm) const;
};

// Positions of one axis at the ends of the lines, on the grid but for the first and the last, which
// are the base's own. Vertices on the base's curve would not do: a chord lies inside a curve, off
// by b̈T²/12 on average, and the nozzle follows that. So they are where they make the nozzle follow
// the polygon as it would follow the base, rounding to the grid included. None goes further out
// than `reach` or the base itself, and no change of speed from line to line exceeds max_accel,
// unless the base's own does.
[[nodiscard]] std::vector<double> vertices(const dynamics::BaseTrajectory& base, AxisAt axis,
                                           const dynamics::FlexibleAxis& nozzle,
                                           const std::vector<double>& times, const AxisGrid& grid,
                                           const Reach& reach, double max_accel_mm_s2);

}  // namespace unflex::emit
