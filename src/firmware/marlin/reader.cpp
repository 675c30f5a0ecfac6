#include <algorithm>
#include <string_view>

#include "firmware_reader.hpp"
#include "hotend_words.hpp"

namespace unflex::firmware::marlin {
namespace {

using gcode::Command;
using gcode::HotendCommand;
using gcode::set_or_wait;

// S comes before R. Without either only a preset, I, does anything; its temperature is the
// printer's own.
std::optional<HotendCommand> hotend_command(const Command& command) {
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

int whole_circles(const Command& command, const gcode::MarlinArcs& rules) {
  constexpr double kMostCircles = 100.0;
  return rules.circles
             ? static_cast<int>(std::clamp(command.value('P').value_or(0.0), 0.0, kMostCircles))
             : 0;
}

gcode::ArcPieces plan_arc(const gcode::Arc& arc, double feed_mm_s, const Command& command,
                          const gcode::InterpreterOptions& options) {
  return gcode::plan_marlin_arc(arc, whole_circles(command, options.marlin_arcs), feed_mm_s,
                                options.marlin_arcs);
}

}  // namespace

extern constexpr gcode::FirmwareReader kReader = {
    .read = &gcode::Interpreter::read_marlin,
    .m_code_effect = gcode::marlin_m_code_effect,
    .plan_arc = plan_arc,
    .hotend_command = hotend_command,
    .selected_tool = [](const Command&) { return std::optional<int>(); },
    .is_meta_command = [](std::string_view) { return false; }};

}  // namespace unflex::firmware::marlin
