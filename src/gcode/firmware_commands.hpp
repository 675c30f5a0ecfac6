// Which commands stop the machine: each firmware's rule. The lists are in klipper_commands.cpp,
// marlin_commands.cpp and rrf_commands.cpp, that of codes unknown to all three in
// foreign_commands.cpp.
#pragma once

#include <algorithm>
#include <string_view>

#include "unflex/core/firmware.hpp"
#include "unflex/gcode/command.hpp"

namespace unflex::gcode {

enum class Effect {
  passive,  // takes effect at its place in the motion, or none; the motion goes on
  stop,     // all motion is finished first; position and modes stay
  unknown,  // may move the machine or change its modes: homing, macros, tool changes
};

// "M118 A1 action:pause", "RESPOND TYPE=command MSG=action:pause": the host may move the machine,
// and by the file's limits.
[[nodiscard]] inline bool asks_host_to_act(const Command& command) {
  return command.arguments.find("action:") != std::string_view::npos;
}

// What an M-code without a handler of its own does.
[[nodiscard]] Effect m_code_effect(Firmware firmware, int number);

// The same for an extended command of Klipper's; the name in upper case.
[[nodiscard]] Effect extended_effect(std::string_view name);

[[nodiscard]] Effect klipper_m_code_effect(int number);
[[nodiscard]] Effect marlin_m_code_effect(int number);
[[nodiscard]] Effect rrf_m_code_effect(int number);
// What the firmwares answer "Unknown command" to.
[[nodiscard]] Effect foreign_m_code_effect(int number);

// What a code with a part behind the point (M201.2) does to Klipper.
[[nodiscard]] Effect klipper_subcode_effect(int number);

// Looks a key up in two sorted lists.
template <class Passive, class Stopping, class Key>
[[nodiscard]] Effect effect_by_lists(const Passive& passive, const Stopping& stopping,
                                     const Key& key) {
  if (std::binary_search(passive.begin(), passive.end(), key)) {
    return Effect::passive;
  }
  return std::binary_search(stopping.begin(), stopping.end(), key) ? Effect::stop : Effect::unknown;
}

}  // namespace unflex::gcode
