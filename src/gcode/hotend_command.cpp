#include "unflex/gcode/hotend_command.hpp"

#include <fmt/core.h>

#include "firmware_reader.hpp"
#include "unflex/core/number.hpp"

namespace unflex::gcode {

std::optional<HotendCommand> hotend_command(const Command& command, Firmware firmware) {
  return reader_of(firmware).hotend_command(command);
}

std::optional<int> selected_tool(const Command& command, Firmware firmware) {
  if (command.kind == CommandKind::traditional && command.letter == 'T') {
    return command.number;
  }
  return reader_of(firmware).selected_tool(command);
}

bool pauses_print(const Command& command) {
  constexpr std::array kCodes = {0, 1, 25, 226, 600, 601};
  for (const int code : kCodes) {
    if (command.is('M', code)) {
      return true;
    }
  }
  return command.kind == CommandKind::extended && command.name == "PAUSE";
}

std::string set_hotend_line(double target_c, std::optional<int> tool) {
  constexpr int kDecimals = 2;
  std::string line = tool ? fmt::format("M104 T{} S", *tool) : "M104 S";
  append_scaled(line, to_scaled(target_c, kDecimals), kDecimals);
  return line;
}

}  // namespace unflex::gcode
