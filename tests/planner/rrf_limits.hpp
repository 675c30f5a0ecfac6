// Limits as RepRapFirmware has them without a config.g.
#pragma once

#include "unflex/planner/planner.hpp"

namespace unflex::planner::testing {

// The firmware's own limits before any M201, M203, M204 or M566 (src/Config/Configuration.h):
//   M203 X100 Y100 Z20 E100 mm/s    M203 I0.5 mm/s     M201 X1000 Y1000 Z200 E500 mm/s²
//   M566 X15 Y15 Z10 E5 mm/s, P0    M204 P50000 T50000 mm/s²
inline Limits rrf_default_limits() {
  Limits limits;
  limits.axis_max_velocity_mm_s = {100.0, 100.0, 20.0, 100.0};
  limits.axis_max_accel_mm_s2 = {1000.0, 1000.0, 200.0, 500.0};
  limits.axis_jerk_mm_s = {15.0, 15.0, 10.0, 5.0};
  limits.print_accel_mm_s2 = 50000.0;
  limits.travel_accel_mm_s2 = 50000.0;
  limits.min_movement_velocity_mm_s = 0.5;
  limits.jerk_policy = 0;
  return limits;
}

}  // namespace unflex::planner::testing
