// Words that several firmwares' commands to the hotend share.
#pragma once

#include <optional>

#include "unflex/core/number.hpp"
#include "unflex/gcode/command.hpp"
#include "unflex/gcode/hotend_command.hpp"

namespace unflex::gcode {

[[nodiscard]] inline std::optional<int> integer(std::optional<double> value) {
  return value ? std::optional(to_int(*value)) : std::nullopt;
}

// M109 R waits while the hotend heats or cools, M109 S only while it heats.
[[nodiscard]] inline HotendCommand set_or_wait(const Command& command, bool either_way) {
  return {.target_c = command.value(either_way ? 'R' : 'S'),
          .tool = integer(command.value('T')),
          .waits = command.is('M', 109),
          .waits_cooling = either_way};
}

}  // namespace unflex::gcode
