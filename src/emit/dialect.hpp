// What a firmware is told in its own words.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "unflex/core/firmware.hpp"
#include "unflex/gcode/interpreter.hpp"
#include "unflex/planner/planner.hpp"

namespace unflex::emit {

// As its makers write it.
[[nodiscard]] std::string_view brand(Firmware firmware);

// `raised` limits for X, Y and filament; what concerns Z and retraction stays as the file has it.
[[nodiscard]] planner::Limits limits_in_run(Firmware firmware, const planner::Limits& file,
                                            planner::Limits raised);

// What Z may do inside a run, whose limits these are: change without a ramp, and accelerate.
struct ZLimits {
  double speed_mm_s;
  double accel_mm_s2;
};
[[nodiscard]] ZLimits z_limits(const planner::FirmwareConfig& config,
                               const planner::Limits& in_run);

// Where a macro may have set limits: what a run sets is unlike any limits, what it leaves to the
// file is as the file has it, so as not to be set to what nobody has said.
[[nodiscard]] planner::Limits unknown_to_run(Firmware firmware, const planner::Limits& file);

// The lines, without their endings, that put `wanted` in force: what differs from `current`.
[[nodiscard]] std::vector<std::string> limit_lines(const planner::FirmwareConfig& config,
                                                   const planner::Limits& wanted,
                                                   const planner::Limits& current);

// The lines that put `wanted` in place of `current`. A default Shaper is none. RepRapFirmware is
// told all of its settings, since it forgets its type while the shaper is off.
[[nodiscard]] std::vector<std::string> shaper_lines(Firmware firmware, const gcode::Shaper& wanted,
                                                    const gcode::Shaper& current);

}  // namespace unflex::emit
