// Commands that are in none of unflex's tables.
#pragma once

#include <string>

#include "unflex/core/firmware.hpp"
#include "unflex/gcode/interpreter.hpp"

namespace unflex::gcode {

// The command of a line whose effect unflex does not know: a macro, or a code of another firmware
// ("MY_MACRO", "M1234.5"). Empty for all other lines. Among these are lines that move the machine
// in a known way (G28, tool changes) and lines with a warning.
[[nodiscard]] std::string unknown_command(const Event& event, Firmware firmware);

}  // namespace unflex::gcode
