// The modes and coordinates that the firmwares share. In other files are motion (motion.cpp,
// retraction.cpp), what becomes uncertain (uncertainty.cpp), and the commands of each firmware
// (commands.cpp in its folder in src/firmware).
#include "unflex/gcode/interpreter.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <initializer_list>
#include <numbers>
#include <utility>

#include "firmware_commands.hpp"
#include "firmware_reader.hpp"
#include "unflex/core/firmware_spec.hpp"
#include "unflex/core/number.hpp"
#include "unflex/gcode/hotend_command.hpp"

namespace unflex::gcode {
namespace {

constexpr std::array<char, 4> kLetters = {'X', 'Y', 'Z', 'E'};
constexpr double kMmPerInch = 25.4;
// An event keeps room for this many segments from line to line.
constexpr std::size_t kKeptSegments = 4;

bool is_motion(const Command& command) {
  return command.kind == CommandKind::traditional && command.letter == 'G' && command.number >= 0 &&
         command.number <= 3;
}

}  // namespace

InterpreterOptions default_options(Firmware firmware) {
  InterpreterOptions options;
  options.firmware = firmware;
  const FirmwareDefaults& defaults = spec_of(firmware).defaults;
  options.firmware_retraction = defaults.has_firmware_retraction;
  options.retract_length_mm = defaults.retract_length_mm;
  options.retract_speed_mm_s = defaults.retract_speed_mm_s;
  options.unretract_speed_mm_s = defaults.unretract_speed_mm_s;
  options.steps_per_mm = defaults.steps_per_mm;
  return options;
}

bool may_come_on(Firmware firmware, const Shaper& own) {
  return spec_of(firmware).filters.shaper_may_come_on || own.is_on() || own.is_unknown();
}

double ModalState::filament_factor() const {
  const double radius_mm = filament_diameter_mm / 2.0;
  return volumetric ? flow_factor / (std::numbers::pi * radius_mm * radius_mm) : flow_factor;
}

Interpreter::Interpreter(InterpreterOptions options) : options_(std::move(options)) {
  state_.shaper.freq_hz = options_.shaper_freq_hz;
  state_.shaper.unknown = options_.shaper_unknown;
  state_.filament_diameter_mm = options_.filament_diameter_mm;
  state_.absolute_e = !options_.relative_e;
  if (options_.begins_advanced) {
    pressure_advance_on_ = true;
  }
  const FirmwareSpec& spec = spec_of(options_.firmware);
  state_.g91_covers_e = spec.reading.g91_covers_e;
  state_.feed_mm_s = spec.reading.first_feed_mm_s;
  if (spec.filters.shapes_both_axes_alike) {
    const bool shapes = options_.shaper_freq_hz.x > 0.0;
    state_.shaper.settings.kept_freq_hz =
        shapes ? std::optional<double>(options_.shaper_freq_hz.x) : std::nullopt;
    state_.shaper.settings.type = on_all_axes<std::string>(shapes ? options_.shaper_type : "none");
  }
}

void Event::reset() {
  kind = EventKind::passive;
  if (segments.capacity() > kKeptSegments) {
    segments = {};  // frees the storage of an arc
  }
  segments.clear();
  limits.reset();
  sets_shaper = false;
  shaper.reset();
  dwell_s = 0.0;
  position_lost = false;
  lost_path_mm = 0.0;
  may_set_limits = false;
  waits_for_buffer = false;
  warnings.clear();
  added = false;
  tool.reset();
}

Event Interpreter::interpret(Line line) {
  Event event;
  event.line = std::move(line);
  interpret(event);
  return event;
}

void Interpreter::interpret(Event& event) {
  event.reset();
  const std::string_view content = event.line.content();
  parse(content, command_);
  // Reading a line of several commands changes command_.
  const std::optional<int> tool = selected_tool(command_, options_.firmware);
  const std::array<bool, 4> known = state_.known;
  (this->*reader_of(options_.firmware).read)(event, content);
  if (tool && *tool >= 0) {
    event.tool = tool;
  }
  if (event.position_lost && is_motion(command_)) {
    note_lost_motion(event, known);
  }
  // Homing and macros take their time.
  swinging_s_ = event.position_lost ? 0.0 : std::max(swinging_s_ - event.dwell_s, 0.0);
}

void Interpreter::other_m_code(Event& event) {
  switch (reader_of(options_.firmware).m_code_effect(command_.number)) {
    case Effect::passive:
      return;
    case Effect::stop:
      event.kind = EventKind::barrier;
      return;
    case Effect::unknown:
      return doubt_position(event);
  }
}

void Interpreter::set_units(bool inches) {
  state_.unit_mm = inches ? kMmPerInch : 1.0;
  update_e_unit();
}

// Marlin's parser.h, axis_unit_factor: after G20 a volume is in cubic inches.
void Interpreter::update_e_unit() {
  const bool is_cube = spec_of(options_.firmware).reading.cubes_units && state_.volumetric;
  state_.e_unit = is_cube ? state_.unit_mm * state_.unit_mm * state_.unit_mm : state_.unit_mm;
}

// The position values stay, but count as unknown: the printer's configuration decides what the axes
// read afterwards. Axes that the line does not name become unknown too: Z is probed above some
// place of the bed (Klipper's safe_z_home.py, Marlin's G28.cpp, home_z_safely, RepRapFirmware's
// homez.g), and X and Y are homed with Z lifted. Homing undoes the effect of G92 on an axis
// (Klipper's gcode_move.py, _handle_home_rails_end; Marlin's motion.cpp, set_axis_is_at_home;
// RepRapFirmware's G92 sets the very position that homing sets).
void Interpreter::home(Event& event) {
  event.kind = EventKind::barrier;
  event.position_lost = true;
  const bool some_named = command_.has_any("XYZ");
  assumed_.fill(false);
  for (const Axis axis : kXYZ) {
    state_.known[axis] = false;
    if (!some_named || command_.has(kLetters[axis])) {
      state_.base_mm[axis] = state_.offset_mm[axis];
      state_.base_known[axis] = true;
    }
  }
}

void Interpreter::set_position(Event& event) {
  std::array<bool, 4> named{};
  for (const Axis axis : kXYZE) {
    const char letter = kLetters[axis];
    named[axis] = command_.has(letter);
    if (named[axis] && !command_.value(letter)) {
      return not_understood(event, fmt::format("G92 with {} but no number", letter));
    }
  }
  // Only Klipper takes a bare G92 for all axes.
  const bool bare = spec_of(options_.firmware).reading.bare_g92_sets_all &&
                    std::none_of(named.begin(), named.end(), [](bool is) { return is; });
  for (const Axis axis : kXYZE) {
    if (bare || named[axis]) {
      const double scale = axis == E ? state_.filament_per_e_mm() : state_.unit_mm;
      const double reading = bare ? 0.0 : *command_.value(kLetters[axis]);
      state_.base_mm[axis] = state_.position_mm[axis] - reading * scale;
      if (axis == E) {
        state_.e_reading_single = static_cast<float>(reading * state_.e_unit);
      }
      // If the place is unknown, all that follows is relative to it. We count as if the machine
      // were still at its last known position.
      state_.base_known[axis] = state_.base_known[axis] && (axis == E || state_.known[axis]);
      state_.known[axis] = true;
    }
  }
  // Only RepRapFirmware stops at G92. But rewritten motion must not reach across a change of the
  // zero.
  if (bare || named[X] || named[Y] || named[Z]) {
    event.kind = EventKind::barrier;
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

void Interpreter::flow_factor(Event& event) {
  const double percent = command_.has('S') ? command_.value('S').value_or(0.0) : 100.0;
  if (percent > 0.0) {
    set_flow_factor(percent / 100.0);
  } else {
    event.warnings.emplace_back("M221 with an invalid S is ignored");
  }
}

// Moves the zero of E so that the reading of E stays (Klipper: gcode_move.py, cmd_M221).
void Interpreter::set_flow_factor(double factor) {
  const double reading = state_.e_reading();
  state_.flow_factor = factor;
  state_.base_mm[E] = state_.position_mm[E] - reading * state_.filament_factor();
}

// Selecting the tool in use changes nothing. Another tool is reached by macros or by moves of the
// firmware itself, and has its own M221 (Marlin: flow_percentage; RepRapFirmware:
// extrusionFactors).
void Interpreter::select_tool(Event& event, int tool) {
  event.kind = EventKind::barrier;
  if (tool_ == tool) {
    return;
  }
  const bool from_another = tool_.has_value();
  lose_tool();
  if (const auto kept = flow_factors_.find(tool); kept != flow_factors_.end()) {
    set_flow_factor(kept->second);
  } else if (from_another) {
    set_flow_factor(1.0);
  }
  state_.retraction.retracted = false;
  state_.retraction.hop_mm = 0.0;
  lose_position(event);
  tool_ = tool;
}

// From here on another tool may be in use.
void Interpreter::lose_tool() {
  if (tool_) {
    flow_factors_[*tool_] = state_.flow_factor;
    tool_.reset();
  }
}

// Sets M221 of a tool. Without `tool` it is the one in use.
void Interpreter::set_flow_of(std::optional<double> tool, double factor) {
  const int in_use = tool_.value_or(0);
  const int number = tool ? to_int(*tool) : in_use;
  if (number == in_use) {
    set_flow_factor(factor);
  } else {
    flow_factors_[number] = factor;
  }
}

// M200: moves the zero of E so that the reading of E stays.
void Interpreter::set_volumetric(bool on, double filament_diameter_mm) {
  const double reading = state_.e_reading();
  state_.volumetric = on;
  state_.filament_diameter_mm = filament_diameter_mm;
  state_.base_mm[E] = state_.position_mm[E] - reading * state_.filament_factor();
  update_e_unit();
}

void Interpreter::limit(Event& event, char letter, double scale, double least,
                        std::optional<double>& value) {
  if (!command_.has(letter)) {
    return;
  }
  const std::optional<double> word = command_.value(letter);
  if (word && *word >= least) {
    value = *word * scale;
    event.kind = EventKind::limits;
  } else {
    event.warnings.push_back(fmt::format("{}{} with an invalid {} is ignored", command_.letter,
                                         command_.number, letter));
  }
}

void Interpreter::axis_limits(Event& event, double scale, double least, AxisValues& values) {
  for (const Axis axis : kXYZE) {
    limit(event, kLetters[axis], scale, least, values[axis]);
  }
}

// M92. The planner keeps the steps of its configuration, so a different value is warned of.
void Interpreter::steps_per_mm(Event& event) {
  for (const Axis axis : kXYZE) {
    const char letter = kLetters[axis];
    const std::optional<double> steps = command_.value(letter);
    if (!steps || *steps <= 0.0 || state_.steps_per_mm[axis] == steps) {
      continue;
    }
    event.kind = EventKind::barrier;
    state_.steps_per_mm[axis] = steps;
    if (*steps != options_.steps_per_mm[axis]) {
      event.warnings.push_back(fmt::format(
          "M92 sets {} steps per mm along {}, but printer.{}_steps_per_mm is {}; they must agree",
          *steps, letter, static_cast<char>(std::tolower(letter)), options_.steps_per_mm[axis]));
    }
  }
}

void Interpreter::note_shaper(Event& event) {
  event.sets_shaper = true;
  event.shaper.edit() = state_.shaper;
}

}  // namespace unflex::gcode
