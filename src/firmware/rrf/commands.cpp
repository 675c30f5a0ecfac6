// RepRapFirmware 3.5. Each function names its source below src/GCodes.

#include <algorithm>
#include <array>
#include <string_view>
#include <vector>

#include "firmware_commands.hpp"
#include "unflex/core/number.hpp"
#include "unflex/gcode/interpreter.hpp"
#include "unflex/gcode/rrf_meta.hpp"

namespace unflex::gcode {
namespace {

// Whether a word comes twice. RepRapFirmware takes the first one.
bool repeats_a_word(const Command& command) {
  for (auto word = command.words.begin(); word != command.words.end(); ++word) {
    if (std::any_of(command.words.begin(), word,
                    [&](const Word& w) { return w.letter == word->letter; })) {
      return true;
    }
  }
  return false;
}

bool begins_command(const Word& word) {
  return word.value && (word.letter == 'G' || word.letter == 'M');
}

// Letter and number of a command.
struct Code {
  char letter;
  int number;
};

// Commands that set a mode, whatever words they have.
bool sets_mode(const Code& code) {
  constexpr std::array kModes = {17, 18, 19, 20, 21, 90, 91, 93, 94};
  return code.letter == 'G' ? std::ranges::find(kModes, code.number) != kModes.end()
                            : code.letter == 'M' && (code.number == 82 || code.number == 83);
}

// Commands that leave all modes but F as they are. G53 acts on its line alone.
bool leaves_modes(const Code& code) {
  constexpr std::array kCodes = {0, 1, 2, 3, 4, 28, 53};
  return code.letter == 'G'
             ? std::ranges::find(kCodes, code.number) != kCodes.end()
             : code.letter == 'M' && rrf_m_code_effect(code.number) != Effect::unknown;
}

// StringParser.cpp, Put, DecodeCommand and FindParameters.
std::string_view rrf_misspelling(const Command& command) {
  const Spelling& spelling = command.spelling;
  if (spelling.number_apart) {
    return "a blank before the command's number, which RepRapFirmware refuses";
  }
  const bool has_words = command.number <= 4 || command.number == 10 || command.number == 92;
  if (spelling.behind_parentheses || (command.letter == 'G' && has_words && spelling.parentheses)) {
    return "parentheses, which are a comment to RepRapFirmware on a CNC machine alone";
  }
  const bool may_matter =
      spelling.exponent &&
      (command.letter != 'M' || rrf_m_code_effect(command.number) == Effect::unknown);
  return may_matter ? "an E right behind a number, which is an exponent to RepRapFirmware" : "";
}

}  // namespace

void Interpreter::read_rrf(Event& event, std::string_view content) {
  read_rrf_line(event, content);
  event.waits_for_buffer = rrf_waits_for_buffer(command_);
}

void Interpreter::read_rrf_line(Event& event, std::string_view content) {
  if (rrf_meta_line(event, content)) {
    return;
  }
  if (command_.kind == CommandKind::none) {
    const bool is_whole_line = !content.empty() && content.front() == ';';
    return is_whole_line && labels_object(command_.comment) ? object_label(event) : void();
  }
  if (has_expression(content)) {
    return rrf_expression(event);
  }
  rrf_command(event);
}

// True if the line needs no more reading: a meta command, or part of a block that may or may not
// run.
bool Interpreter::rrf_meta_line(Event& event, std::string_view content) {
  const MetaCommand meta = meta_command(content);
  if (command_.kind == CommandKind::none && meta == MetaCommand::none) {
    return false;
  }
  const std::size_t indent = indentation(content);
  if (block_indent_ && indent <= *block_indent_) {
    block_indent_.reset();
  }
  switch (meta) {
    case MetaCommand::block:
      block_indent_ = block_indent_.value_or(indent);
      lose_position(event);
      return true;
    case MetaCommand::jump:
      lose_position(event);
      return true;
    case MetaCommand::harmless:
      // The values it reads must be those that the file has set, not those of a run.
      if (reads_machine(content)) {
        lose_position(event);
      }
      return true;
    case MetaCommand::none:
      break;
  }
  if (block_indent_) {
    rrf_conditional_line(event, content);
    return true;
  }
  return false;
}

void Interpreter::rrf_conditional_line(Event& event, std::string_view content) {
  lose_tool();  // the line may or may not change the tool
  if (has_expression(content)) {
    rrf_expression(event);
    return lose_position(event);
  }
  maybe(event, &Interpreter::rrf_command, "a mode or a limit set under a condition");
}

// unflex does not evaluate expressions. The line is harmless if its command is harmless.
void Interpreter::rrf_expression(Event& event) {
  const bool is_m = command_.kind == CommandKind::traditional && command_.letter == 'M';
  const bool is_g = command_.letter == 'G' && command_.number >= 0;
  if (is_m && rrf_m_code_effect(command_.number) != Effect::unknown) {
    return other_m_code(event);
  }
  switch (is_m ? command_.number : -1) {
    case 200:
    case 220:
    case 221:
    case 593:
      return uncertain_modes(event, "a factor set by an expression");
    case 201:
    case 203:
    case 204:
    case 205:
    case 207:
    case 566:
      return uncertain_modes(event, "a limit set by an expression");
    default:
      feed_uncertain_ = feed_uncertain_ || is_g;
      return lose_position(event);
  }
}

void Interpreter::rrf_command(Event& event) {
  if (command_.kind == CommandKind::extended) {
    return lose_position(event);  // refused, unless a plug-in takes it
  }
  if (command_.kind == CommandKind::malformed) {
    return not_understood(event, command_.problem);
  }
  if (const std::string_view problem = rrf_misspelling(command_); !problem.empty()) {
    return doubtful_line(event, &Interpreter::rrf_as_meant, problem);
  }
  rrf_as_meant(event);
}

void Interpreter::rrf_as_meant(Event& event) {
  const bool is_m = command_.letter == 'M';
  const bool is_g = command_.letter == 'G';
  if (std::ranges::any_of(command_.words, begins_command)) {
    return rrf_several_commands(event);
  }
  if ((is_g || is_m) && repeats_a_word(command_)) {
    return is_m && rrf_m_code_effect(command_.number) != Effect::unknown
               ? other_m_code(event)
               : not_understood(event, "two commands in one line, or a word given twice");
  }
  if (command_.subnumber > 0 && command_.letter != 'T') {
    // GCodes2.cpp, HandleMcode: all other codes with a fraction are macros. M201.1 is for probing.
    constexpr std::array kWithFraction = {36, 201, 586, 587};
    const bool passive =
        is_m && std::ranges::find(kWithFraction, command_.number) != kWithFraction.end();
    return passive ? void() : lose_position(event);
  }
  if (is_g) {
    rrf_g_code(event);
  } else if (is_m) {
    rrf_m_code(event);
  } else if (command_.letter == 'T') {
    select_tool(event, command_.number);  // GCodes2.cpp, HandleTcode
  } else {
    lose_position(event);
  }
}

// StringParser.cpp, FindParameters and FinishedCommand: a command ends where the next begins, and
// each is carried out. unflex follows this only if all of them do no more than set modes.
void Interpreter::rrf_several_commands(Event& event) {
  std::vector<Code> codes = {{command_.letter, command_.number}};
  for (const Word& word : command_.words) {
    if (begins_command(word)) {
      codes.push_back({word.letter, to_int(*word.value)});
    }
  }
  const bool is_all_codes = codes.size() == command_.words.size() + 1;
  if (is_all_codes && std::ranges::all_of(codes, sets_mode)) {
    command_.words.clear();
    for (const Code& code : codes) {
      command_.letter = code.letter;
      command_.number = code.number;
      rrf_as_meant(event);
    }
    return;
  }
  if (!std::ranges::all_of(codes, leaves_modes)) {
    return uncertain_modes(event, "several commands in one line");
  }
  feed_uncertain_ = feed_uncertain_ || command_.has('F');
  if (std::ranges::any_of(codes, [](const Code& code) { return code.letter == 'G'; })) {
    return not_understood(event, "two commands in one line, or a word given twice");
  }
  for (const Code& code : codes) {
    command_.number = code.number;
    other_m_code(event);
  }
}

void Interpreter::rrf_g_code(Event& event) {
  switch (command_.number) {
    case 0:
    case 1:
      return rrf_linear_move(event);
    case 2:
    case 3:
      return rrf_arc_move(event);
    case 4:
      return rrf_dwell(event);
    case 10:
      return rrf_g10(event);
    case 11:
      return retraction_and_hop(event, false);
    case 17:
    case 18:
    case 19:
      return rrf_plane(event);
    case 20:
    case 21:
      return set_units(command_.number == 20);
    case 28:
      return home(event);
    case 31:
      return;  // the probe's settings or reading
    case 60:
      event.kind = EventKind::barrier;  // saves the position, which must be the file's
      return;
    case 90:
    case 91:
      state_.absolute_xyz = command_.number == 90;
      return;
    case 92:
      return set_position(event);
    case 93:
    case 94:
      state_.inverse_time = command_.number == 93;
      return;
    default:
      return lose_position(event);
  }
}

void Interpreter::rrf_m_code(Event& event) {
  switch (command_.number) {
    case 18:
    case 84:
      return command_.has_any("S") && !command_.has_any("XYZE")
                 ? static_cast<void>(event.kind = EventKind::barrier)  // S: a time-out
                 : lose_position(event);
    case 82:
    case 83:
      state_.absolute_e = command_.number == 82;
      return;
    case 92:
      return steps_per_mm(event);
    case 101:
    case 103:
      return retraction_and_hop(event, command_.number == 103);
    case 109:
      return rrf_wait_for_heater(event);
    case 120:
      return rrf_push(event);
    case 121:
      return rrf_pop();
    case 291:
      return rrf_message_box(event);
    case 486:
      return object_label(event);
    case 501:
    case 502:
      return limits_unknown(event);
    default:
      return rrf_setting(event);
  }
}

// Carries out the M-codes that set a factor, a limit, pressure advance or the shaper, and those
// that have no handler of their own.
void Interpreter::rrf_setting(Event& event) {
  constexpr double kPerMinute = 1.0 / 60.0;
  switch (command_.number) {
    case 200:
      return rrf_volumetric();
    case 201:
      return rrf_axis_acceleration(event);
    case 203:
      return rrf_max_velocity(event);
    case 204:
      return rrf_acceleration(event);
    case 205:
      return rrf_jerk(event, 1.0);
    case 207:
      return rrf_retraction_settings(event);
    case 220:
      return rrf_speed_factor(event);
    case 221:
      return rrf_flow_factor(event);
    case 566:
      return rrf_jerk(event, kPerMinute);
    case 572:
      rrf_pressure_advance(event);
      return other_m_code(event);
    case 593:
      return rrf_shaper(event);
    default:
      return other_m_code(event);
  }
}

// Move.cpp, ConfigurePressureAdvance: S of the extruders that D names, of all without D. unflex
// follows the first extruder.
void Interpreter::rrf_pressure_advance(Event& event) {
  const std::optional<double> advance = command_.value('S');
  if (advance && *advance >= 0.0 && command_.value('D').value_or(0.0) == 0.0) {
    state_.pressure_advance.advance_s = advance;
    if (options_.advance_of_runs == RunAdvance::off) {
      event.kind = EventKind::barrier;
    }
  }
}

// GCodes.cpp, DoStraightMove: H is a homing move, R starts from a restore point, P sets outputs and
// S a laser's power. M220 and M221 apply only where an axis is named
// (LoadExtrusionAndFeedrateFromGCode).
void Interpreter::rrf_linear_move(Event& event) {
  if (state_.inverse_time) {
    return not_understood(event, "a move in inverse time mode (G93)");
  }
  if (command_.value('H').value_or(0.0) != 0.0 || command_.has_any("ABCDPRSUVW")) {
    return lose_position(event);
  }
  if (command_.has_any("XYZ") || !command_.has('E')) {
    return linear_move(event);
  }
  const double speed_factor = state_.speed_factor;
  const double flow_factor = state_.flow_factor;
  state_.speed_factor = 1.0;
  set_flow_factor(1.0);
  linear_move(event);
  state_.speed_factor = speed_factor;
  set_flow_factor(flow_factor);
}

// GCodes.cpp, DoArcMove: reads the plane's axes, I, J, K, R, E, F and further axes where the
// machine has them. Other letters count for nothing, such as P, which slicers write behind a lift
// for Marlin.
void Interpreter::rrf_arc_move(Event& event) {
  if (state_.inverse_time) {
    return not_understood(event, "a move in inverse time mode (G93)");
  }
  if (command_.has_any("ABCDUVW")) {
    return lose_position(event);
  }
  arc_move(event, command_.number == 2);
}

// GCodes2.cpp, HandleGcode: with L, P, R, S or an axis it sets a tool or a workplace.
void Interpreter::rrf_g10(Event& event) {
  if (command_.has_any("LXYZUVWABCD")) {
    return lose_position(event);
  }
  if (!command_.has_any("PRS")) {
    retraction_and_hop(event, true);
  }
}

// GCodes2.cpp: waits for the end of all motion if the plane is another.
void Interpreter::rrf_plane(Event& event) {
  if (state_.plane != command_.number) {
    state_.plane = command_.number;
    event.kind = EventKind::barrier;
  }
}

// GCodes.cpp, DoDwell: S in seconds takes precedence over P in milliseconds.
void Interpreter::rrf_dwell(Event& event) {
  event.kind = EventKind::barrier;
  constexpr double kSecondsPerMs = 1e-3;
  const double pause_s = command_.has('S') ? command_.value('S').value_or(0.0)
                                           : command_.value('P').value_or(0.0) * kSecondsPerMs;
  event.dwell_s = std::max(0.0, pause_s);
}

// GCodes2.cpp, M109: without a target it only waits. With a target and no tool in use it selects a
// tool, which runs macros.
void Interpreter::rrf_wait_for_heater(Event& event) {
  event.kind = EventKind::barrier;
  if (command_.has_any("RS") && tool_.value_or(-1) < 0) {
    lose_position(event);
    tool_ = to_int(command_.value('T').value_or(0.0));
  }
}

// GCodes7.cpp, DoMessageBox: from S2 on it waits, and the user may move axes meanwhile.
void Interpreter::rrf_message_box(Event& event) {
  constexpr double kFirstThatWaits = 2.0;
  if (command_.value('S').value_or(1.0) >= kFirstThatWaits) {
    lose_position(event);
  }
}

// GCodeMachineState.cpp: M120 saves the modes, and E is a length from here on. As with Klipper's
// SAVE_GCODE_STATE, the saved modes must be those of the file, not those of a run.
void Interpreter::rrf_push(Event& event) {
  event.kind = EventKind::barrier;
  pushed_states_.push_back(state_);
  set_volumetric(false, state_.filament_diameter_mm);
}

// GCodes.cpp, Pop: modes and F come back, positions and factors stay.
void Interpreter::rrf_pop() {
  if (pushed_states_.empty()) {
    return;
  }
  const ModalState& kept = pushed_states_.back();
  state_.absolute_xyz = kept.absolute_xyz;
  state_.absolute_e = kept.absolute_e;
  state_.feed_mm_s = kept.feed_mm_s;
  state_.plane = kept.plane;
  state_.inverse_time = kept.inverse_time;
  set_units(kept.unit_mm != 1.0);
  set_volumetric(kept.volumetric, state_.filament_diameter_mm);
  pushed_states_.pop_back();
}

}  // namespace unflex::gcode
