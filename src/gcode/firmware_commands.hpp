// Which commands stop the machine. The lists of a firmware are in its folder in src/firmware, in
// effects.cpp. Codes that no firmware knows are in foreign_commands.cpp.
#pragma once

#include <algorithm>
#include <string_view>

#include "unflex/core/firmware.hpp"
#include "unflex/gcode/command.hpp"

namespace unflex::gcode {

enum class Effect {
  passive,  // takes effect at its place in the motion or has none; the motion goes on
  stop,     // all motion is finished first; position and modes stay
  unknown,  // may move the machine or change its modes: homing, macros, tool changes
};

// Whether the line asks the host to act ("M118 A1 action:pause", "RESPOND TYPE=command
// MSG=action:pause"). The host may then move the machine, which must obey the file's limits.
[[nodiscard]] inline bool asks_host_to_act(const Command& command) {
  return command.arguments.find("action:") != std::string_view::npos;
}

// The effect of an extended command of Klipper. `name` is in upper case.
[[nodiscard]] Effect extended_effect(std::string_view name);

// The effect of an M-code without a handler of its own.
[[nodiscard]] Effect klipper_m_code_effect(int number);
[[nodiscard]] Effect marlin_m_code_effect(int number);
[[nodiscard]] Effect rrf_m_code_effect(int number);
// Whether RepRapFirmware carries the line out only when no move waits in front of its queue.
[[nodiscard]] bool rrf_waits_for_buffer(const Command& command);
// The effect of an M-code that all three firmwares answer with "Unknown command".
[[nodiscard]] Effect foreign_m_code_effect(int number);

// The effect on Klipper of a code with a part behind the point (M201.2).
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
