// The command that a line gives to a hotend.
//   Klipper  kinematics/extruder.py (M104, M109, ACTIVATE_EXTRUDER), extras/heaters.py
//            (SET_HEATER_TEMPERATURE, TURN_OFF_HEATERS, TEMPERATURE_WAIT);
//   Marlin   gcode/temp/M104_M109.cpp;
//   RepRapFirmware  GCodes/GCodes2.cpp, GCodes3.cpp: M104, M109, M116, M568, G10.
#pragma once

#include <optional>
#include <string>

#include "unflex/core/firmware.hpp"
#include "unflex/gcode/command.hpp"

namespace unflex::gcode {

// A command to the hotend of a tool.
struct HotendCommand {
  std::optional<double> target_c;  // 0: off; none: the target stays
  std::optional<int> tool;         // none: the tool in use
  bool waits = false;              // until the hotend is no colder than the target
  bool waits_cooling = false;      // and no hotter
};

// nullopt if the line asks nothing of a hotend, or nothing that the firmware understands.
[[nodiscard]] std::optional<HotendCommand> hotend_command(const Command& command,
                                                          Firmware firmware);

// The tool that the line selects; below 0: no tool is in use from there on. nullopt if the line
// selects nothing, or is a macro, which may select anything.
[[nodiscard]] std::optional<int> selected_tool(const Command& command, Firmware firmware);

// Whether the line may hold the print up for long, as a pause or a change of filament does.
[[nodiscard]] bool pauses_print(const Command& command);

// A line that sets the target and does not wait, in words that all three firmwares take; it has no
// line ending. The target is rounded to 0.01 °C. tool: none is the tool in use.
[[nodiscard]] std::string set_hotend_line(double target_c, std::optional<int> tool);

}  // namespace unflex::gcode
