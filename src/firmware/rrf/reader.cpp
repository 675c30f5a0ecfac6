#include <string_view>

#include "firmware_reader.hpp"
#include "hotend_words.hpp"
#include "unflex/gcode/rrf_meta.hpp"

namespace unflex::firmware::rrf {
namespace {

using gcode::Command;
using gcode::HotendCommand;
using gcode::integer;
using gcode::set_or_wait;

std::optional<HotendCommand> hotend_command(const Command& command) {
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

gcode::ArcPieces plan_arc(const gcode::Arc& arc, double feed_mm_s, const Command& /*command*/,
                          const gcode::InterpreterOptions& /*options*/) {
  return gcode::plan_rrf_arc(arc, feed_mm_s);
}

}  // namespace

extern constexpr gcode::FirmwareReader kReader = {
    .read = &gcode::Interpreter::read_rrf,
    .m_code_effect = gcode::rrf_m_code_effect,
    .plan_arc = plan_arc,
    .hotend_command = hotend_command,
    .selected_tool = [](const Command&) { return std::optional<int>(); },
    .is_meta_command =
        [](std::string_view content) {
          return gcode::meta_command(content) != gcode::MetaCommand::none;
        }};

}  // namespace unflex::firmware::rrf
