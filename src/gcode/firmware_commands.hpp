// Which commands stop the machine: Klipper's rule.
#pragma once

#include <string_view>

namespace unflex::gcode {

enum class Effect {
  passive,  // takes effect at its place in the motion, or none; the motion goes on
  stop,     // all motion is finished first; position and modes stay
  unknown,  // may move the machine or change its modes: homing, macros, tool changes
};

// What an M-code without a handler of its own does.
[[nodiscard]] Effect m_code_effect(int number);

// The same for an extended command; the name in upper case.
[[nodiscard]] Effect extended_effect(std::string_view name);

}  // namespace unflex::gcode
