// The printer's limits inside a compensated run.
#pragma once

#include "unflex/planner/planner.hpp"

namespace unflex::emit {

// Limits that a run needs for X, Y and the filament.
struct RunLimits {
  double velocity_mm_s = 0.0;
  double accel_mm_s2 = 0.0;
  double corner_velocity_mm_s = 0.0;
};

// Limits high enough for `run`, so that the firmware never slows a line down. Z keeps its limits
// from `limits`.
[[nodiscard]] planner::Limits limits_of_runs(const planner::FirmwareConfig& config,
                                             planner::Limits limits, const RunLimits& run);

}  // namespace unflex::emit
