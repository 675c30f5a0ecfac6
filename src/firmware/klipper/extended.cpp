// Klipper's extended commands, NAME KEY=VALUE.
#include <fmt/core.h>

#include <array>
#include <charconv>
#include <cmath>
#include <string>
#include <string_view>
#include <system_error>

#include "firmware_commands.hpp"
#include "printer_number.hpp"
#include "unflex/core/firmware_spec.hpp"
#include "unflex/core/number.hpp"
#include "unflex/core/own_marks.hpp"
#include "unflex/gcode/interpreter.hpp"

namespace unflex::gcode {
namespace {

// Reads the number of a parameter. Unlike the number of a word it may have an exponent
// ("ACCEL=1e5").
std::optional<double> parse_parameter_number(std::string_view text) {
  const std::size_t exponent = text.find_first_of("eE");
  if (exponent == std::string_view::npos || !parse_number(text.substr(0, exponent))) {
    return parse_number(text);
  }
  if (text.front() == '+') {
    text.remove_prefix(1);
  }
  double value = 0.0;
  const char* const end = text.data() + text.size();
  const auto [stop, failure] = std::from_chars(text.data(), end, value, std::chars_format::general);
  if (failure != std::errc{} || stop != end || !std::isfinite(value)) {
    return std::nullopt;
  }
  return value;
}

struct Parameter {
  bool given = false;
  std::optional<double> value;

  [[nodiscard]] bool unreadable() const { return given && !value; }
};

Parameter number_of(const Command& command, std::string_view key) {
  const std::optional<std::string> text = command.parameter(key);
  if (!text) {
    return {};
  }
  const std::optional<double> number = parse_parameter_number(*text);
  return {true, number && fits_printers(*number) ? std::optional(as_printers_take_it(*number))
                                                 : std::nullopt};
}

std::string state_name(const Command& command) {
  return command.parameter("NAME").value_or("default");
}

}  // namespace

void Interpreter::extended(Event& event) {
  const std::string_view name = command_.name;
  if (name == "SET_VELOCITY_LIMIT" || name == kLimitsMacro) {
    return velocity_limit(event);
  }
  if (name == "SET_PRESSURE_ADVANCE") {
    return pressure_advance(event);
  }
  if (name == "SET_RETRACTION") {
    return retraction_settings(event);
  }
  if (name == "SET_GCODE_OFFSET") {
    return gcode_offset(event);
  }
  if (name == "SAVE_GCODE_STATE") {
    // The saved modes must be those of the file, not those of rewritten motion.
    saved_states_.insert_or_assign(state_name(command_), state_);
    event.kind = EventKind::border;
    return;
  }
  if (name == "RESTORE_GCODE_STATE") {
    return restore_state(event);
  }
  if (name == "SET_INPUT_SHAPER") {
    return input_shaper(event);
  }
  // EXCLUDE_OBJECT can cancel an object, so that the rest of it is left out.
  if (name == "EXCLUDE_OBJECT_START" || name == "EXCLUDE_OBJECT_END" || name == "EXCLUDE_OBJECT") {
    return object_label(event);
  }
  if (name == "TUNING_TOWER") {
    return uncertain_modes(event, "TUNING_TOWER sets what it tunes with every new Z");
  }
  if (name == "RESPOND" && asks_host_to_act(command_)) {
    return lose_position(event);
  }
  switch (extended_effect(name)) {
    case Effect::passive:
      return;
    case Effect::stop:
      event.kind = EventKind::barrier;
      return;
    case Effect::unknown:
      return doubt_position(event);
  }
}

// toolhead.py, cmd_SET_VELOCITY_LIMIT: if one value is invalid, nothing is set.
void Interpreter::velocity_limit(Event& event) {
  const Parameter velocity = number_of(command_, "VELOCITY");
  const Parameter accel = number_of(command_, "ACCEL");
  const Parameter corner = number_of(command_, "SQUARE_CORNER_VELOCITY");
  const Parameter cruise = number_of(command_, "MINIMUM_CRUISE_RATIO");
  const Parameter to_decel = number_of(command_, "ACCEL_TO_DECEL");
  const bool invalid = (velocity.given && !(velocity.value.value_or(0.0) > 0.0)) ||
                       (accel.given && !(accel.value.value_or(0.0) > 0.0)) ||
                       (corner.given && !(corner.value.value_or(-1.0) >= 0.0)) ||
                       (cruise.given && !(cruise.value.value_or(-1.0) >= 0.0)) ||
                       (cruise.given && !(cruise.value.value_or(1.0) < 1.0));
  if (invalid) {
    event.warnings.emplace_back("SET_VELOCITY_LIMIT with an invalid value is ignored");
    return;
  }
  // From March 2024 to August 2025 ACCEL_TO_DECEL sets the cruise ratio, unless the line gives
  // that.
  event.may_set_limits = to_decel.given && !cruise.given;
  if (velocity.given || accel.given || corner.given || cruise.given || to_decel.given) {
    event.kind = EventKind::limits;
    event.limits.edit().max_velocity_mm_s = velocity.value;
    event.limits.edit().max_accel_mm_s2 = accel.value;
    event.limits.edit().square_corner_velocity_mm_s = corner.value;
    event.limits.edit().minimum_cruise_ratio = cruise.value;
    if (to_decel.value.value_or(0.0) > 0.0) {
      event.limits.edit().accel_to_decel_mm_s2 = to_decel.value;
    }
  }
}

// extras/input_shaper.py, cmd_SET_INPUT_SHAPER: SHAPER_TYPE is for both axes.
void Interpreter::input_shaper(Event& event) {
  event.kind = EventKind::barrier;
  const auto number = [&](std::string_view of) {
    return map_axes(
        [&](std::string_view letter) {
          return number_of(command_, fmt::format("{}_{}", of, letter));
        },
        kAxisLetters);
  };
  const Axes<Parameter> freq = number("SHAPER_FREQ");
  const Axes<Parameter> damping = number("DAMPING_RATIO");
  const auto is_unreadable = [](const Parameter& of_freq, const Parameter& of_damping) {
    return of_freq.unreadable() || of_damping.unreadable();
  };
  if (any_axis(is_unreadable, freq, damping)) {
    event.warnings.emplace_back("SET_INPUT_SHAPER with an invalid value is ignored");
    return;
  }
  const std::optional<std::string> both = command_.parameter("SHAPER_TYPE");
  for_each_axis(
      [&](std::string_view letter, std::string& type) {
        type =
            command_.parameter(fmt::format("SHAPER_TYPE_{}", letter)).value_or(both.value_or(type));
      },
      kAxisLetters, state_.shaper.settings.type);
  for_each_axis([](const Parameter& told,
                   std::optional<double>& ratio) { ratio = told.value ? told.value : ratio; },
                damping, state_.shaper.settings.damping_ratio);
  for_each_axis(
      [](const Parameter& told, double& freq_hz, bool& unknown, bool& touched) {
        if (told.value) {
          freq_hz = *told.value;
          unknown = touched = false;
        }
      },
      freq, state_.shaper.freq_hz, state_.shaper.unknown, state_.shaper_touched);
  note_shaper(event);
}

// Klipper's extras/exclude_object.py, Marlin's gcode/feature/cancel/M486.cpp, RepRapFirmware's
// GCodes5.cpp, ChangeToObject: no firmware stops at a label. But if the user has cancelled the
// object, all its motion is left out, and the next move goes straight from where the machine then
// is.
void Interpreter::object_label(Event& event) {
  event.kind = EventKind::border;
  for (const Axis axis : kXY) {
    assumed_[axis] = assumed_[axis] || state_.known[axis];
    state_.known[axis] = false;
  }
  z_left_out_ = spec_of(options_.firmware).reading.labels_leave_out_z;
}

// kinematics/extruder.py, _set_pressure_advance: a new smoothing time stops the machine, and
// switching the advance on or off changes the smoothing time too.
void Interpreter::pressure_advance(Event& event) {
  const Parameter advance = number_of(command_, "ADVANCE");
  const Parameter smooth_time = number_of(command_, "SMOOTH_TIME");
  PressureAdvance& state = state_.pressure_advance;
  std::string extruder = command_.parameter("EXTRUDER").value_or("");
  if (extruder != state.extruder) {
    state = PressureAdvance{};
    state.extruder = std::move(extruder);
    pressure_advance_on_.reset();
  }
  bool stops =
      options_.advance_of_runs == RunAdvance::off || command_.parameter("SMOOTH_TIME").has_value();
  if (smooth_time.value) {
    state.smooth_s = *smooth_time.value;
  }
  if (advance.value) {
    const bool on = *advance.value > 0.0;
    stops = stops || pressure_advance_on_ != on;
    pressure_advance_on_ = on;
    state.advance_s = *advance.value;
  }
  if (stops) {
    event.kind = EventKind::barrier;
  }
}

// firmware_retraction.py, cmd_SET_RETRACTION.
void Interpreter::retraction_settings(Event& event) {
  struct Setting {
    std::string_view key;
    double least;
    double* target;
  };
  InterpreterOptions changed = options_;
  const std::array<Setting, 4> settings = {
      {{"RETRACT_LENGTH", 0.0, &changed.retract_length_mm},
       {"RETRACT_SPEED", 1.0, &changed.retract_speed_mm_s},
       {"UNRETRACT_EXTRA_LENGTH", 0.0, &changed.unretract_extra_length_mm},
       {"UNRETRACT_SPEED", 1.0, &changed.unretract_speed_mm_s}}};
  for (const Setting& setting : settings) {
    const Parameter parameter = number_of(command_, setting.key);
    if (parameter.unreadable() || parameter.value.value_or(setting.least) < setting.least) {
      event.warnings.push_back(
          fmt::format("SET_RETRACTION with an invalid {} is ignored", setting.key));
      return;
    }
    *setting.target = parameter.value.value_or(*setting.target);
  }
  options_ = changed;
  state_.retraction.retracted = false;
}

// gcode_move.py, cmd_SET_GCODE_OFFSET: the zero moves; the machine moves only with MOVE=1.
void Interpreter::gcode_offset(Event& event) {
  constexpr std::array<std::string_view, 4> kKeys = {"X", "Y", "Z", "E"};
  constexpr std::array<std::string_view, 4> kAdjustKeys = {"X_ADJUST", "Y_ADJUST", "Z_ADJUST",
                                                           "E_ADJUST"};
  Position shift_mm{};
  for (const Axis axis : kXYZE) {
    const Parameter offset = number_of(command_, kKeys[axis]);
    const Parameter adjust = number_of(command_, kAdjustKeys[axis]);
    if (offset.unreadable() || (!offset.given && adjust.unreadable())) {
      return not_understood(event, "SET_GCODE_OFFSET with a value that is no number");
    }
    shift_mm[axis] =
        offset.given ? *offset.value - state_.offset_mm[axis] : adjust.value.value_or(0.0);
  }
  const Parameter move = number_of(command_, "MOVE");
  const bool moves = move.given && move.value != 0.0;
  event.kind = EventKind::border;
  for (const Axis axis : kXYZE) {
    state_.offset_mm[axis] += shift_mm[axis];
    state_.base_mm[axis] += shift_mm[axis];
    if (moves) {
      state_.position_mm[axis] += shift_mm[axis];
    }
  }
  if (moves) {
    lose_position(event);
  }
}

// gcode_move.py, cmd_RESTORE_GCODE_STATE: E goes on from where it is; X, Y and Z return only with
// MOVE=1.
void Interpreter::restore_state(Event& event) {
  const auto saved = saved_states_.find(state_name(command_));
  if (saved == saved_states_.end()) {
    return not_understood(event, "RESTORE_GCODE_STATE of a state this file does not save");
  }
  const ModalState& state = saved->second;
  state_.absolute_xyz = state.absolute_xyz;
  state_.absolute_e = state.absolute_e;
  state_.base_mm = state.base_mm;
  state_.base_mm[E] += state_.position_mm[E] - state.position_mm[E];
  for (const Axis axis : kXYZ) {
    // If one of the two zeros was set at an unknown place, their distance on the bed is unknown.
    const bool zero_known = state_.base_known[axis] && state.base_known[axis];
    state_.known[axis] = state_.known[axis] && zero_known;
    if (axis != Z) {
      assumed_[axis] = assumed_[axis] && zero_known;
    }
  }
  state_.base_known = state.base_known;
  state_.offset_mm = state.offset_mm;
  state_.feed_mm_s = state.feed_mm_s;
  state_.speed_factor = state.speed_factor;
  state_.flow_factor = state.flow_factor;
  event.kind = EventKind::border;
  const Parameter move = number_of(command_, "MOVE");
  if (move.given && move.value != 0.0) {
    for (const Axis axis : kXYZ) {
      state_.position_mm[axis] = state.position_mm[axis];
    }
    lose_position(event);
  }
}

}  // namespace unflex::gcode
