// Modes, coordinates and everything that is no motion. Motion is in motion.cpp, Klipper's extended
// commands are in extended.cpp.
#include "unflex/gcode/interpreter.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "firmware_commands.hpp"

namespace unflex::gcode {
namespace {

constexpr std::array<char, 4> kAxisLetters = {'X', 'Y', 'Z', 'E'};
constexpr double kMmPerInch = 25.4;

}  // namespace

Interpreter::Interpreter(InterpreterOptions options) : options_(options) {
  state_.shaper_freq_x_hz = options.shaper_freq_x_hz;
  state_.shaper_freq_y_hz = options.shaper_freq_y_hz;
}

Event Interpreter::interpret(Line line) {
  Event event;
  event.line.number = line.number;
  parse(line.content(), command_);
  switch (command_.kind) {
    case CommandKind::none:
      break;
    case CommandKind::traditional:
      traditional(event);
      break;
    case CommandKind::extended:
      extended(event);
      break;
    case CommandKind::malformed:
      not_understood(event, command_.problem);
      break;
  }
  event.line = std::move(line);
  return event;
}

void Interpreter::traditional(Event& event) {
  constexpr int kPrinterCheck = 862;  // M862.1 to M862.6
  if (command_.subnumber >= 0) {
    if (command_.letter != 'M' || command_.number != kPrinterCheck) {
      lose_position(event);
    }
  } else if (command_.letter == 'G') {
    g_code(event);
  } else if (command_.letter == 'M') {
    m_code(event);
  } else {
    lose_position(event);  // T, or a letter that begins no command
  }
}

void Interpreter::g_code(Event& event) {
  switch (command_.number) {
    case 0:
    case 1:
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
      state_.unit_mm = kMmPerInch;
      return;
    case 21:
      state_.unit_mm = 1.0;
      return;
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
    default:
      return lose_position(event);
  }
}

void Interpreter::m_code(Event& event) {
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
    default:
      break;
  }
  switch (m_code_effect(command_.number)) {
    case Effect::passive:
      return;
    case Effect::stop:
      event.kind = EventKind::barrier;
      return;
    case Effect::unknown:
      return lose_position(event);
  }
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

// Position values stay: what the axes read afterwards is the printer's configuration, not in the
// text. Homing takes the effect of G92 off an axis (gcode_move.py, _handle_home_rails_end).
void Interpreter::home(Event& event) {
  event.kind = EventKind::barrier;
  event.position_lost = true;
  const bool some_named = command_.has('X') || command_.has('Y') || command_.has('Z');
  for (const Axis axis : {X, Y, Z}) {
    if (!some_named || command_.has(kAxisLetters[axis])) {
      state_.known[axis] = false;
      state_.base_mm[axis] = state_.offset_mm[axis];
      state_.base_known[axis] = true;
    }
  }
}

void Interpreter::set_position(Event& event) {
  std::array<bool, 4> named{};
  for (const Axis axis : {X, Y, Z, E}) {
    const char letter = kAxisLetters[axis];
    named[axis] = command_.has(letter);
    if (named[axis] && !command_.value(letter)) {
      return not_understood(event, fmt::format("G92 with {} but no number", letter));
    }
  }
  const bool bare = std::none_of(named.begin(), named.end(), [](bool is) { return is; });
  for (const Axis axis : {X, Y, Z, E}) {
    if (bare || named[axis]) {
      const double scale = axis == E ? state_.unit_mm * state_.flow_factor : state_.unit_mm;
      const double reading = bare ? 0.0 : *command_.value(kAxisLetters[axis]);
      state_.base_mm[axis] = state_.position_mm[axis] - reading * scale;
      state_.base_known[axis] = axis == E || state_.known[axis];
    }
  }
  // E is only ever used as a difference, so naming it anew makes it known.
  state_.known[E] = state_.known[E] || bare || named[E];
  if (bare || named[X] || named[Y] || named[Z]) {
    event.kind = EventKind::barrier;
  }
}

// toolhead.py, cmd_M204: S, or the smaller of P and T; one of them alone is refused.
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
    event.limits.max_accel_mm_s2 = accel;
  }
}

void Interpreter::speed_factor(Event& event) {
  const double percent = command_.has('S') ? command_.value('S').value_or(0.0) : 100.0;
  if (percent > 0.0) {
    state_.speed_factor = percent / 100.0;
  } else {
    event.warnings.emplace_back("M220 with an invalid S is ignored");
  }
}

// The zero of E moves so that its reading stays (gcode_move.py, cmd_M221).
void Interpreter::flow_factor(Event& event) {
  const double percent = command_.has('S') ? command_.value('S').value_or(0.0) : 100.0;
  if (percent > 0.0) {
    const double reading = (state_.position_mm[E] - state_.base_mm[E]) / state_.flow_factor;
    state_.flow_factor = percent / 100.0;
    state_.base_mm[E] = state_.position_mm[E] - reading * state_.flow_factor;
  } else {
    event.warnings.emplace_back("M221 with an invalid S is ignored");
  }
}

void Interpreter::lose_position(Event& event) {
  event.kind = EventKind::barrier;
  event.position_lost = true;
  state_.known.fill(false);
}

void Interpreter::not_understood(Event& event, std::string_view problem) {
  lose_position(event);
  event.warnings.push_back(fmt::format("{}: passed through unchanged; check the line", problem));
}

}  // namespace unflex::gcode
