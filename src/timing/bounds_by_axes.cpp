#include <algorithm>
#include <cmath>

#include "unflex/core/firmware_spec.hpp"
#include "unflex/timing/timing.hpp"

namespace unflex::timing {
namespace {

using gcode::E;
using gcode::X;
using gcode::Y;
using gcode::Z;

void limit(MoveBounds& bounds, double per_mm, double speed_mm_s, double accel_mm_s2) {
  if (per_mm != 0.0) {
    bounds.speed_mm_s = std::min(bounds.speed_mm_s, speed_mm_s / std::abs(per_mm));
    bounds.accel_mm_s2 = std::min(bounds.accel_mm_s2, accel_mm_s2 / std::abs(per_mm));
  }
}

}  // namespace

// Klipper: klippy/kinematics/cartesian.py and extruder.py, check_move(). The others limit each axis
// by itself.
MoveBounds bounds_by_axes(const planner::PlannedMove& move, const planner::Limits& limits,
                          const planner::FirmwareConfig& config) {
  MoveBounds bounds;
  const gcode::Position& direction = move.direction;
  if (!spec_of(config.firmware).motion.has_axis_limits) {
    bounds.speed_mm_s = limits.max_velocity_mm_s;
    limit(bounds, direction[Z], config.max_z_velocity_mm_s, config.max_z_accel_mm_s2);
    if (direction[E] < 0.0) {
      limit(bounds, direction[E], config.max_extrude_only_velocity_mm_s,
            config.max_extrude_only_accel_mm_s2);
    }
    return bounds;
  }
  for (const gcode::Axis axis : {X, Y}) {
    limit(bounds, direction[axis], limits.axis_max_velocity_mm_s[axis], planner::kNoLimit);
  }
  for (const gcode::Axis axis : {Z, E}) {
    limit(bounds, direction[axis], limits.axis_max_velocity_mm_s[axis],
          limits.axis_max_accel_mm_s2[axis]);
  }
  return bounds;
}

}  // namespace unflex::timing
