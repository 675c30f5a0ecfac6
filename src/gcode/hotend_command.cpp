#include "unflex/gcode/hotend_command.hpp"

#include <fmt/core.h>

#include <array>
#include <string_view>

#include "unflex/core/number.hpp"

namespace unflex::gcode {
namespace {

std::optional<int> integer(std::optional<double> value) {
  return value ? std::optional(to_int(*value)) : std::nullopt;
}

// "extruder" is tool 0, "extruder1" is tool 1. nullopt for any other heater.
std::optional<int> tool_of_heater(std::string_view name) {
  constexpr std::string_view kExtruder = "extruder";
  if (!name.starts_with(kExtruder)) {
    return std::nullopt;
  }
  name.remove_prefix(kExtruder.size());
  return name.empty() ? std::optional(0) : integer(parse_number(name));
}

std::optional<HotendCommand> extended_command(const Command& command) {
  const auto tool = [&](std::string_view key) {
    return tool_of_heater(command.parameter(key).value_or(""));
  };
  if (command.name == "SET_HEATER_TEMPERATURE" && tool("HEATER")) {
    return HotendCommand{.target_c = parse_number(command.parameter("TARGET").value_or("0")),
                         .tool = tool("HEATER")};
  }
  if (command.name == "TEMPERATURE_WAIT" && tool("SENSOR")) {
    return HotendCommand{.target_c = std::nullopt,
                         .tool = tool("SENSOR"),
                         .waits = true,
                         .waits_cooling = command.parameter("MAXIMUM").has_value()};
  }
  if (command.name == "TURN_OFF_HEATERS") {
    return HotendCommand{.target_c = 0.0, .tool = std::nullopt};
  }
  return std::nullopt;
}

// Klipper takes a missing S for 0. Its M109 waits until the hotend is neither colder nor hotter
// than the target, and at 0 it does not wait.
std::optional<HotendCommand> klipper_command(const Command& command) {
  if (command.kind == CommandKind::extended) {
    return extended_command(command);
  }
  const bool waits = command.is('M', 109);
  if (!waits && !command.is('M', 104)) {
    return std::nullopt;
  }
  const double target_c = command.value('S').value_or(0.0);
  return HotendCommand{.target_c = target_c,
                       .tool = integer(command.value('T')),
                       .waits = waits && target_c > 0.0,
                       .waits_cooling = waits && target_c > 0.0};
}

// M109 R waits while the hotend heats or cools, M109 S only while it heats.
HotendCommand set_or_wait(const Command& command, bool either_way) {
  return {.target_c = command.value(either_way ? 'R' : 'S'),
          .tool = integer(command.value('T')),
          .waits = command.is('M', 109),
          .waits_cooling = either_way};
}

// S comes before R. Without either only a preset, I, does anything; its temperature is the
// printer's own.
std::optional<HotendCommand> marlin_command(const Command& command) {
  const bool waits = command.is('M', 109);
  if (!waits && !command.is('M', 104)) {
    return std::nullopt;
  }
  const bool is_preset = command.has('I');
  const bool either_way = waits && !command.value('S') && (is_preset || command.value('R'));
  HotendCommand result = set_or_wait(command, either_way);
  if (is_preset) {
    result.target_c.reset();
  }
  return is_preset || result.target_c ? std::optional(result) : std::nullopt;
}

std::optional<HotendCommand> rrf_command(const Command& command) {
  const bool waits = command.is('M', 109);
  if (waits || command.is('M', 104)) {
    const HotendCommand result = set_or_wait(command, waits && command.value('R').has_value());
    return waits || result.target_c ? std::optional(result) : std::nullopt;
  }
  if (command.is('M', 116)) {
    return HotendCommand{.target_c = std::nullopt,
                         .tool = integer(command.value('P')),
                         .waits = true,
                         .waits_cooling = true};
  }
  // S is the temperature of a tool in use. L and axes make G10 set offsets.
  const bool sets_tool =
      command.is('M', 568) || (command.is('G', 10) && !command.has_any("LXYZUVWABCD"));
  if (sets_tool && command.value('S')) {
    return HotendCommand{.target_c = command.value('S'), .tool = integer(command.value('P'))};
  }
  return std::nullopt;
}

}  // namespace

std::optional<HotendCommand> hotend_command(const Command& command, Firmware firmware) {
  switch (firmware) {
    case Firmware::klipper:
      return klipper_command(command);
    case Firmware::marlin:
      return marlin_command(command);
    case Firmware::rrf:
      return rrf_command(command);
  }
  return std::nullopt;
}

std::optional<int> selected_tool(const Command& command, Firmware firmware) {
  if (command.kind == CommandKind::traditional && command.letter == 'T') {
    return command.number;
  }
  if (firmware == Firmware::klipper && command.name == "ACTIVATE_EXTRUDER") {
    return tool_of_heater(command.parameter("EXTRUDER").value_or(""));
  }
  return std::nullopt;
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
