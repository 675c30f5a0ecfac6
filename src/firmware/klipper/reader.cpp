#include <string_view>

#include "firmware_reader.hpp"
#include "hotend_words.hpp"

namespace unflex::firmware::klipper {
namespace {

using gcode::Command;
using gcode::CommandKind;
using gcode::HotendCommand;
using gcode::integer;

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
std::optional<HotendCommand> hotend_command(const Command& command) {
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

std::optional<int> selected_tool(const Command& command) {
  return command.name == "ACTIVATE_EXTRUDER"
             ? tool_of_heater(command.parameter("EXTRUDER").value_or(""))
             : std::nullopt;
}

gcode::ArcPieces plan_arc(const gcode::Arc& arc, double /*feed_mm_s*/, const Command& /*command*/,
                          const gcode::InterpreterOptions& options) {
  return gcode::plan_arc(arc, options.arc_resolution_mm);
}

}  // namespace

extern constexpr gcode::FirmwareReader kReader = {
    .read = &gcode::Interpreter::read_klipper,
    .m_code_effect = gcode::klipper_m_code_effect,
    .plan_arc = plan_arc,
    .hotend_command = hotend_command,
    .selected_tool = selected_tool,
    .is_meta_command = [](std::string_view) { return false; }};

}  // namespace unflex::firmware::klipper
