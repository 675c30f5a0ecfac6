// Short ways to Marlin's plans.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "planner/plan_helpers.hpp"
#include "unflex/planner/marlin_planner.hpp"

namespace unflex::planner::testing {

inline FirmwareConfig marlin_config() {
  FirmwareConfig config;
  config.firmware = Firmware::marlin;
  config.steps_per_mm = {80.0, 80.0, 400.0, 93.0};
  return config;
}

// Limits without stretching after a stop, and with axes that allow everything.
inline Limits marlin_limits() {
  Limits limits;
  limits.min_segment_time_s = 0.0;
  limits.axis_max_velocity_mm_s = {1000.0, 1000.0, 1000.0, 1000.0};
  limits.axis_max_accel_mm_s2 = {3000.0, 3000.0, 3000.0, 3000.0};
  return limits;
}

inline std::vector<PlannedMove> marlin_plan(const std::vector<gcode::Segment>& segments,
                                            const Limits& limits = marlin_limits(),
                                            const FirmwareConfig& config = marlin_config()) {
  MarlinPlanner planner(limits, config);
  for (const gcode::Segment& each : segments) planner.add(each);
  planner.stop();
  std::vector<PlannedMove> result;
  planner.take(result);
  return result;
}

// Whole steps per axis, without sign.
inline std::array<double, 4> axis_steps(const PlannedMove& move, const FirmwareConfig& config) {
  std::array<double, 4> steps{};
  for (std::size_t axis = 0; axis < steps.size(); ++axis) {
    const double travel_mm = move.segment.end_mm[axis] - move.segment.start_mm[axis];
    steps[axis] = std::round(std::abs(travel_mm) * config.steps_per_mm[axis]);
  }
  return steps;
}

// Length per step event.
inline double step_mm(const PlannedMove& move, const FirmwareConfig& config) {
  return move.length_mm / std::ranges::max(axis_steps(move, config));
}

}  // namespace unflex::planner::testing
