// Limits and shapers in each firmware's own commands.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "unflex/core/firmware.hpp"
#include "unflex/emit/run_limits.hpp"
#include "unflex/gcode/interpreter.hpp"
#include "unflex/planner/planner.hpp"

namespace unflex::emit {

// The command that sets Klipper's limits.
inline constexpr std::string_view kKlipperLimits = "SET_VELOCITY_LIMIT";

// Sets the limits of a run where each axis has its own.
void set_axis_limits(const RunLimits& run, planner::Limits& limits);

// The limits of a run, with the acceleration of X, Y and filament raised to `accel_mm_s2`.
[[nodiscard]] planner::Limits raised(planner::Limits in_run, double accel_mm_s2);

// The limits `raised` for X, Y and filament, and the file's limits for Z and retraction.
[[nodiscard]] planner::Limits limits_in_run(Firmware firmware, const planner::Limits& file,
                                            planner::Limits raised);

// Limits of Z inside a run with the limits in_run: how far its speed may jump, and how fast it
// may accelerate.
struct ZLimits {
  double speed_mm_s;
  double accel_mm_s2;
};
[[nodiscard]] ZLimits z_limits(const planner::FirmwareConfig& config,
                               const planner::Limits& in_run);

// Limits that a run assumes to be in force after a macro that may have changed them. Limits that a
// run sets are unknown, so they are always written. Limits that a run leaves to the file are as the
// file has them, so that no value is written which nobody has said.
[[nodiscard]] planner::Limits unknown_to_run(Firmware firmware, const planner::Limits& file);

// The lines, without their endings, that put `wanted` in force. They contain only what differs from
// `current`.
[[nodiscard]] std::vector<std::string> limit_lines(const planner::FirmwareConfig& config,
                                                   const planner::Limits& wanted,
                                                   const planner::Limits& current);

// The line, one of limit_lines(), that has no effect once the run has been interrupted. Klipper
// with checkpoints: the rest of such a run goes on from standstill by the printer's own limits.
[[nodiscard]] std::string unless_interrupted(std::string line);

// The lines that put `wanted` in place of `current`. A default Shaper means no shaper. An axis
// whose wanted shaper is unknown stays as it is. RepRapFirmware is told all settings, since it
// forgets its type while the shaper is off.
[[nodiscard]] std::vector<std::string> shaper_lines(Firmware firmware, const gcode::Shaper& wanted,
                                                    const gcode::Shaper& current);

// The line that sets pressure advance, which has to be given. The smooth time and the name of the
// extruder are Klipper's; without a smooth time it stays as it is.
[[nodiscard]] std::string advance_line(Firmware firmware, const gcode::PressureAdvance& wanted);

// The command to type after the print, for axes whose shaper is off while the printer may have one
// that is not known: "SET_INPUT_SHAPER SHAPER_FREQ_X=... SHAPER_FREQ_Y=...". Empty if there are no
// such axes.
[[nodiscard]] std::string unknown_shaper_lines(Firmware firmware, const gcode::Shaper& wanted,
                                               const gcode::Shaper& current);

}  // namespace unflex::emit
