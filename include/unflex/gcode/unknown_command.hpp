// Commands that no table here knows.
#pragma once

#include <string>

#include "unflex/core/firmware.hpp"
#include "unflex/gcode/interpreter.hpp"

namespace unflex::gcode {

// The command of a line that may do anything, since nothing here knows what it does: a macro, or a
// code of another firmware ("MY_MACRO", "M1234.5"). Empty for all other lines, those among them
// that move the machine in a known way (G28, tool changes) or have been warned of.
[[nodiscard]] std::string unknown_command(const Event& event, Firmware firmware);

}  // namespace unflex::gcode
