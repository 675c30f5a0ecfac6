// The time before a motion out of a standstill.
#pragma once

#include "unflex/planner/planner.hpp"

namespace unflex::planner {

// How long the firmware takes for the first step out of a standstill, with limits as high as those
// of a run. 0: none.
//
// Marlin 2.1.2: 1 / MINIMAL_STEP_RATE (src/module/planner.cpp, calculate_trapezoid_for_block).
[[nodiscard]] double first_step_s(const FirmwareConfig& config);

// How long the machine rests before a run whose first move this is: first_step_s(), or 0 if it
// comes from another move, such as one of filament alone, at some speed.
[[nodiscard]] double wait_s(const PlannedMove& first, const FirmwareConfig& config);

}  // namespace unflex::planner
