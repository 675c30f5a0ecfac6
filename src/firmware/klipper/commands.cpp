// Klipper's commands of G and M: klippy/gcode.py, toolhead.py, extras/gcode_move.py. Its commands
// with names are in extended.cpp.
#include <algorithm>
#include <initializer_list>
#include <string_view>

#include "firmware_commands.hpp"
#include "unflex/gcode/interpreter.hpp"

namespace unflex::gcode {
namespace {

// gcode.py, _process_commands: Klipper splits the line at runs of letters. All that stands between
// two runs (blanks, zeros, parentheses) belongs to the command's number or to a value.
std::string_view klipper_misspelling(const Command& command) {
  const Spelling& spelling = command.spelling;
  const auto is_one_of = [&](char letter, std::initializer_list<int> numbers) {
    return command.letter == letter && std::ranges::find(numbers, command.number) != numbers.end();
  };
  if (spelling.number_apart || spelling.number_padded) {
    return "Klipper knows no command that is written with a blank or a zero before its number";
  }
  if (spelling.parentheses || spelling.behind_parentheses) {
    return "parentheses, which are no comment to Klipper";
  }
  if (spelling.other_text && is_one_of('M', {82, 83, 204, 220, 221})) {
    return "more than a number behind a letter, which Klipper refuses";
  }
  const bool may_matter = spelling.joined_letters && (is_one_of('G', {0, 1, 2, 3, 4, 10, 28, 92}) ||
                                                      is_one_of('M', {204, 220, 221}));
  return may_matter ? "letters without a number between them, which are one word to Klipper" : "";
}

// Whether a word with a number names an axis beside X, Y, Z and E. ("Xnan" does not name A.)
bool names_further_axis(const Command& command) {
  return std::ranges::any_of(command.words, [](const Word& word) {
    return word.value && std::string_view("ABCUVW").find(word.letter) != std::string_view::npos;
  });
}

}  // namespace

void Interpreter::read_klipper(Event& event, std::string_view /*content*/) {
  const bool is_command =
      command_.kind == CommandKind::traditional || command_.kind == CommandKind::extended;
  if (const std::string_view problem = klipper_misspelling(command_);
      is_command && !problem.empty()) {
    return not_understood(event, problem);
  }
  switch (command_.kind) {
    case CommandKind::none:
      break;
    case CommandKind::traditional:
      klipper_traditional(event);
      break;
    case CommandKind::extended:
      extended(event);
      break;
    case CommandKind::malformed:
      not_understood(event, command_.problem);
      break;
  }
}

void Interpreter::klipper_traditional(Event& event) {
  if (command_.subnumber >= 0) {
    if (command_.letter != 'M' || klipper_subcode_effect(command_.number) == Effect::unknown) {
      lose_position(event);
    }
  } else if (command_.letter == 'G') {
    klipper_g_code(event);
  } else if (command_.letter == 'M') {
    klipper_m_code(event);
  } else {
    lose_position(event);  // T, or a letter that begins no command
  }
}

void Interpreter::klipper_g_code(Event& event) {
  switch (command_.number) {
    case 0:
    case 1:
      if (names_further_axis(command_)) {
        return lose_position(event);  // may be a stepper that MANUAL_STEPPER has made an axis
      }
      return linear_move(event);
    case 2:
    case 3:
      return arc_move(event, command_.number == 2);
    case 4:
      return dwell(event);
    case 10:
    case 11:
      return firmware_retraction(event, command_.number == 10);
    case 17:
    case 18:
    case 19:
      state_.plane = command_.number;
      return;
    case 20:
      set_units(true);
      event.warnings.emplace_back("Klipper refuses G20, and ends the print");
      return;
    case 21:
      return set_units(false);
    case 28:
      return home(event);
    case 90:
      state_.absolute_xyz = true;
      return;
    case 91:
      state_.absolute_xyz = false;
      return;
    case 92:
      return set_position(event);
    case 392:
      return;  // Bambu: clog detection; Klipper does not know it
    default:
      return lose_position(event);
  }
}

void Interpreter::klipper_m_code(Event& event) {
  switch (command_.number) {
    case 82:
      state_.absolute_e = true;
      return;
    case 83:
      state_.absolute_e = false;
      return;
    case 204:
      return acceleration(event);
    case 220:
      return speed_factor(event);
    case 221:
      return flow_factor(event);
    case 486:
      return object_label(event);
    case 201:
    case 202:
    case 203:
    case 205:
    case 566:
      event.may_set_limits = true;
      break;
    default:
      break;
  }
  other_m_code(event);
}

// Klipper reads P alone, in ms.
void Interpreter::dwell(Event& event) {
  event.kind = EventKind::barrier;
  const double pause_ms = command_.value('P').value_or(0.0);
  if (pause_ms < 0.0 || (command_.has('P') && !command_.value('P'))) {
    event.warnings.emplace_back("G4 without a valid P: no pause is counted");
    return;
  }
  constexpr double kSecondsPerMs = 1e-3;
  event.dwell_s = pause_ms * kSecondsPerMs;
}

// toolhead.py, cmd_M204: S, or the smaller of P and T. P or T alone is refused.
void Interpreter::acceleration(Event& event) {
  for (const char letter : {'S', 'P', 'T'}) {
    if (command_.has(letter) && !(command_.value(letter).value_or(0.0) > 0.0)) {
      event.warnings.push_back(fmt::format("M204 with an invalid {} is ignored", letter));
      return;
    }
  }
  std::optional<double> accel = command_.value('S');
  if (!accel && command_.has('P') && command_.has('T')) {
    accel = std::min(*command_.value('P'), *command_.value('T'));
  }
  if (accel) {
    event.kind = EventKind::limits;
    event.limits.edit().max_accel_mm_s2 = accel;
  }
}

}  // namespace unflex::gcode
