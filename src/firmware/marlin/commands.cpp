// Marlin 2.1.2. Each function names its source below src/gcode.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "characters.hpp"
#include "firmware_commands.hpp"
#include "firmware_reader.hpp"
#include "unflex/gcode/interpreter.hpp"

namespace unflex::gcode {
namespace {

constexpr double kSecondsPerMinute = 60.0;
constexpr double kAboveZero = 1e-9;

// Whole numbers, as parser.value_int() reads them.
std::optional<double> whole(std::optional<double> value) {
  return value ? std::optional<double>(std::trunc(*value)) : std::nullopt;
}

// Whether an S word sets the power of a laser. Behind a second command, which counts for nothing, S
// belongs to that command.
bool sets_laser(const Command& command) { return command.has('S') && !command.has_any("GMT"); }

// Why a Marlin as it is usually built may read the line differently; empty if it does not.
std::string_view doubt(std::string_view content, const Command& command) {
  std::string_view code = content.substr(0, content.find(';'));
  const std::size_t parenthesis = code.find('(');
  const bool has_words = command.number <= 4 || command.number == 92;
  if (command.spelling.behind_parentheses ||
      (command.letter == 'G' && has_words && parenthesis != std::string_view::npos)) {
    return "a comment in parentheses, which Marlin reads only if PAREN_COMMENTS is set";
  }
  if (command.letter == 'G') {
    code = code.substr(0, parenthesis);
  }
  // In an M-code lower case matters only in M itself: texts and names may stand behind its number.
  const std::size_t first = code.find_first_not_of(" \t");
  const bool lower = command.letter == 'G' ? std::any_of(code.begin(), code.end(), is_lower)
                                           : first < code.size() && is_lower(code[first]);
  return lower ? "lower case, which Marlin reads only if GCODE_CASE_INSENSITIVE is set" : "";
}

}  // namespace

void Interpreter::read_marlin(Event& event, std::string_view content) {
  if (event.line.has_bare_return()) {
    return not_understood(event,
                          "a carriage return without a line feed, which ends the line for Marlin");
  }
  switch (command_.kind) {
    case CommandKind::none:
      return;
    case CommandKind::extended:
      return lose_position(event);  // Marlin echoes it, but a host may act on it
    case CommandKind::malformed:
      if (!content.empty() && content.front() == '@') {
        return lose_position(event);  // a command to the host
      }
      return not_understood(event, command_.problem);
    case CommandKind::traditional:
      break;
  }
  if (const std::string_view problem = doubt(content, command_); !problem.empty()) {
    return doubtful_line(event, &Interpreter::marlin_command, problem);
  }
  marlin_command(event);
}

void Interpreter::marlin_command(Event& event) {
  const bool is_m = command_.letter == 'M';
  if (command_.subnumber > 0) {
    const bool passive = is_m && marlin_m_code_effect(command_.number) == Effect::passive;
    return passive ? void() : lose_position(event);
  }
  if (command_.letter == 'G') {
    marlin_g_code(event);
  } else if (is_m) {
    marlin_m_code(event);
  } else if (command_.letter == 'T') {
    select_tool(event, command_.number);
  } else {
    lose_position(event);  // a letter that begins no command
  }
}

void Interpreter::marlin_g_code(Event& event) {
  switch (command_.number) {
    case 0:
    case 1:
      return marlin_linear_move(event);
    case 2:
    case 3:
      if (command_.has_any("ABCUVW") || sets_laser(command_)) {
        return lose_position(event);
      }
      return state_.plane == 17 ? arc_move(event, command_.number == 2)
                                : not_understood(event, "an arc outside the XY plane");
    case 4:
      return marlin_dwell(event);
    case 10:
    case 11:
      // In Marlin G10 has no other meaning; S1 is the long retraction of a tool change.
      return options_.firmware_retraction ? retraction_and_hop(event, command_.number == 10)
                                          : void();
    case 17:
    case 18:
    case 19:
      state_.plane = command_.number;
      return;
    case 20:
      set_units(true);
      event.warnings.emplace_back("Marlin reads G20 only if INCH_MODE_SUPPORT is set");
      return;
    case 21:
      return set_units(false);
    case 28:
      return home(event);
    case 60:
      event.kind = EventKind::barrier;  // saves the position, which must be the file's
      return;
    case 90:
    case 91:
      // gcode.h, set_relative_mode: sets the mode of E too, until M82 or M83 changes it.
      state_.absolute_xyz = state_.absolute_e = command_.number == 90;
      return;
    case 92:
      return set_position(event);
    default:
      return lose_position(event);
  }
}

void Interpreter::marlin_m_code(Event& event) {
  switch (command_.number) {
    case 18:
    case 84:
      return command_.value('S') ? void() : lose_position(event);  // S: a time-out
    case 82:
    case 83:
      state_.absolute_e = command_.number == 82;
      return;
    case 92:
      return steps_per_mm(event);
    case 118:
      return asks_host_to_act(command_) ? lose_position(event) : other_m_code(event);
    case 200:
      return marlin_volumetric(event);
    case 201:
      return axis_limits(event, state_.unit_mm, kAboveZero,
                         event.limits.edit().axis_max_accel_mm_s2);
    case 203:
      return axis_limits(event, state_.unit_mm, kAboveZero,
                         event.limits.edit().axis_max_velocity_mm_s);
    case 204:
      return marlin_acceleration(event);
    case 205:
      return marlin_advanced_settings(event);
    case 207:
    case 208:
    case 209:
      return marlin_retraction_settings(event);
    case 217:
      // tool/M217.cpp: Q primes, T changes to another extruder.
      return command_.has_any("QT") ? lose_position(event) : other_m_code(event);
    case 220:
      return marlin_speed_factor(event);
    case 221:
      return marlin_flow_factor(event);
    case 486:
      return object_label(event);
    case 493:
      return marlin_fixed_time_motion(event);
    case 501:
    case 502:
      return limits_unknown(event);
    case 593:
      return marlin_shaper(event);
    case 900:
      return marlin_pressure_advance(event);
    default:
      return other_m_code(event);
  }
}

// motion/G0_G1.cpp. Under M209 a short move of E alone is replaced by firmware retraction. The
// length in the line never reaches the planner.
void Interpreter::marlin_linear_move(Event& event) {
  constexpr double kShortest_mm = 0.1;  // MIN_AUTORETRACT
  constexpr double kLongest_mm = 10.0;  // MAX_AUTORETRACT
  if (command_.has_any("ABCHIJKUVW") || sets_laser(command_)) {
    return lose_position(event);  // further axes, a mixing extruder, or a laser's power
  }
  const std::optional<double> word = command_.value('E');
  if (!state_.retraction.automatic || !word || command_.has_any("XYZ")) {
    return linear_move(event);
  }
  const double scale = state_.filament_factor();
  const double reading = state_.e_reading();
  const double change = state_.absolute_e ? *word * state_.e_unit - reading : *word * state_.e_unit;
  if (std::abs(change) < kShortest_mm || std::abs(change) > kLongest_mm ||
      state_.retraction.retracted != (change > 0.0)) {
    return linear_move(event);
  }
  if (const auto feed = command_.value('F')) {
    set_feed(feed);
  }
  state_.base_mm[E] -= change * scale;
  retraction_and_hop(event, change < 0.0);
}

// motion/G4.cpp: S in seconds is read after P in milliseconds, so S wins.
void Interpreter::marlin_dwell(Event& event) {
  event.kind = EventKind::barrier;
  constexpr double kSecondsPerMs = 1e-3;
  const double pause_s =
      command_.value('S').value_or(command_.value('P').value_or(0.0) * kSecondsPerMs);
  if (pause_s < 0.0) {
    event.warnings.emplace_back("G4 with a negative time: no pause is counted");
    return;
  }
  event.dwell_s = pause_s;
}

// config/M200-M205.cpp, M204: S sets both P and T.
void Interpreter::marlin_acceleration(Event& event) {
  const double unit = state_.unit_mm;
  LimitChange& limits = event.limits.edit();
  limit(event, 'S', unit, kAboveZero, limits.print_accel_mm_s2);
  limits.travel_accel_mm_s2 = limits.print_accel_mm_s2;
  limit(event, 'P', unit, kAboveZero, limits.print_accel_mm_s2);
  limit(event, 'R', unit, kAboveZero, limits.retract_accel_mm_s2);
  limit(event, 'T', unit, kAboveZero, limits.travel_accel_mm_s2);
}

// config/M200-M205.cpp, M205. The build of Marlin decides whether J or the jerks count.
void Interpreter::marlin_advanced_settings(Event& event) {
  constexpr double kSecondsPerMicrosecond = 1e-6;
  constexpr double kLeastDeviation_mm = 0.01;
  constexpr double kMostDeviation_mm = 0.3;
  const double unit = state_.unit_mm;
  LimitChange& limits = event.limits.edit();
  limit(event, 'B', kSecondsPerMicrosecond, 0.0, limits.min_segment_time_s);
  limit(event, 'S', unit, 0.0, limits.min_velocity_mm_s);
  limit(event, 'T', unit, 0.0, limits.min_travel_velocity_mm_s);
  axis_limits(event, unit, 0.0, limits.axis_jerk_mm_s);
  const std::optional<double> deviation = command_.value('J');
  if (deviation && *deviation * unit >= kLeastDeviation_mm &&
      *deviation * unit <= kMostDeviation_mm) {
    limits.junction_deviation_mm = *deviation * unit;
    event.kind = EventKind::limits;
  } else if (command_.has('J')) {
    event.warnings.emplace_back("M205 with J outside 0.01 to 0.3 is ignored");
  }
}

// config/M220.cpp: R restores the kept factor, then B keeps the factor from before the line, then S
// sets a new one.
void Interpreter::marlin_speed_factor(Event& event) {
  const double before = state_.speed_factor;
  if (command_.has('R')) {
    state_.speed_factor = state_.kept_speed_factor;
  }
  if (command_.has('B')) {
    state_.kept_speed_factor = before;
  }
  if (const auto percent = whole(command_.value('S'))) {
    if (*percent > 0.0) {
      state_.speed_factor = *percent / 100.0;
    } else {
      event.warnings.emplace_back("M220 with an invalid S is ignored");
    }
  }
}

// config/M221.cpp.
void Interpreter::marlin_flow_factor(Event& event) {
  const auto percent = whole(command_.value('S'));
  if (percent && *percent > 0.0) {
    set_flow_of(command_.value('T'), *percent / 100.0);
  } else if (percent) {
    event.warnings.emplace_back("M221 with an invalid S is ignored");
  }
}

// config/M200-M205.cpp, M200: a diameter makes E a volume, D0 and S0 make it a length.
void Interpreter::marlin_volumetric(Event& event) {
  if (!command_.has_any("DS")) {
    return;
  }
  bool on = state_.volumetric;
  bool may = true;
  double diameter_mm = state_.filament_diameter_mm;
  if (const auto d = command_.value('D')) {
    may = *d > 0.0;
    on = on || may;
    diameter_mm = may ? *d * state_.unit_mm : diameter_mm;
    if (*d < 0.0) {
      event.warnings.emplace_back("M200 with an invalid D is ignored");
      return;
    }
  }
  if (command_.has('S')) {
    on = command_.value('S').value_or(1.0) >= 1.0;
  }
  set_volumetric(may && on, diameter_mm);
}

// feature/fwretract.cpp, M207 to M209.
void Interpreter::marlin_retraction_settings(Event& event) {
  const double unit = state_.unit_mm;
  const auto set = [&](char letter, double scale, double& target) {
    const std::optional<double> value = command_.value(letter);
    if (value && *value >= 0.0) {
      target = *value * scale;
    } else if (value) {
      event.warnings.push_back(
          fmt::format("M{} with an invalid {} is ignored", command_.number, letter));
    }
  };
  switch (command_.number) {
    case 207:
      set('S', unit, options_.retract_length_mm);
      set('F', unit / kSecondsPerMinute, options_.retract_speed_mm_s);
      set('Z', unit, options_.retract_z_hop_mm);
      return;
    case 208:
      set('S', unit, options_.unretract_extra_length_mm);
      set('F', unit / kSecondsPerMinute, options_.unretract_speed_mm_s);
      return;
    default:
      if (command_.has('S')) {
        state_.retraction.automatic =
            options_.firmware_retraction && command_.value('S').value_or(1.0) != 0.0;
        state_.retraction.retracted = false;  // fwretract.h, refresh_autoretract
      }
      return;
  }
}

// feature/ft_motion/M493.cpp. Without S1 the standard motion stays in force.
void Interpreter::marlin_fixed_time_motion(Event& event) {
  event.kind = EventKind::barrier;
  if (command_.value('S').value_or(0.0) != 0.0) {
    event.warnings.emplace_back(
        "M493 S1 switches fixed-time motion on, which plans and shapes otherwise than unflex "
        "reckons; take it out, or compensated motion behind it is drawn wrong");
  }
}

// feature/advance/M900.cpp: a new K waits for the end of all motion.
void Interpreter::marlin_pressure_advance(Event& event) {
  constexpr double kMost = 10.0;
  const std::optional<double> k = command_.value('K');
  if (command_.has_any("LST")) {  // for another extruder, or for another of its two values
    event.kind = EventKind::barrier;
    pressure_advance_on_.reset();
    return;
  }
  const bool stops = options_.advance_of_runs == RunAdvance::off || !pressure_advance_on_ ||
                     state_.pressure_advance.advance_s != k;
  if (k && *k >= 0.0 && *k <= kMost && stops) {
    state_.pressure_advance.advance_s = k;
    pressure_advance_on_ = *k > 0.0;
    event.kind = EventKind::barrier;
  }
}

}  // namespace unflex::gcode
