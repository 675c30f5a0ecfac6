// RepRapFirmware's limits, factors and retraction settings. Each function names its source below
// src/GCodes. None of these commands is in inches.
#include <fmt/core.h>

#include <algorithm>
#include <optional>

#include "unflex/core/number.hpp"
#include "unflex/gcode/interpreter.hpp"

namespace unflex::gcode {
namespace {

// The firmware raises a value that is too small to `least`.
void raise(std::optional<double>& value, double least) {
  if (value) {
    value = std::max(least, *value);
  }
}

void raise(AxisValues& values, double least) {
  for (std::optional<double>& value : values) {
    raise(value, least);
  }
}

constexpr double kMinAccel_mm_s2 = 0.1;     // MinimumAcceleration
constexpr double kMinJerk_mm_s = 0.1;       // MinimumJerk
constexpr double kMinVelocity_mm_s = 0.01;  // AbsoluteMinFeedrate

}  // namespace

// GCodes2.cpp, M201.
void Interpreter::rrf_axis_acceleration(Event& event) {
  axis_limits(event, 1.0, 0.0, event.limits.edit().axis_max_accel_mm_s2);
  raise(event.limits.edit().axis_max_accel_mm_s2, kMinAccel_mm_s2);
}

// GCodes2.cpp, M203: mm/min, or mm/s with S1. No axis is slower than I, whether the line sets I or
// an earlier one did. The planner sees to that.
void Interpreter::rrf_max_velocity(Event& event) {
  const double scale = command_.value('S') == 1.0 ? 1.0 : 1.0 / 60.0;
  std::optional<double>& least = event.limits.edit().min_movement_velocity_mm_s;
  limit(event, 'I', scale, 0.0, least);
  raise(least, kMinVelocity_mm_s);
  axis_limits(event, scale, 0.0, event.limits.edit().axis_max_velocity_mm_s);
  raise(event.limits.edit().axis_max_velocity_mm_s, kMinVelocity_mm_s);
  // No printer is limited so on purpose. Marlin's M203 is in mm/s.
  constexpr double kSlow_mm_s = 10.0;
  for (const Axis axis : kXY) {
    const auto& limit_mm_s = event.limits.edit().axis_max_velocity_mm_s[axis];
    if (limit_mm_s && *limit_mm_s < kSlow_mm_s && event.warnings.empty()) {
      event.warnings.push_back(
          fmt::format("M203 is in mm/min on RepRapFirmware, and this limits {} to {:.3g} mm/s; was "
                      "{:.4g} mm/s meant?",
                      axis == X ? 'X' : 'Y', *limit_mm_s, *limit_mm_s / scale));
    }
  }
}

// GCodes5.cpp, ConfigureAccelerations.
void Interpreter::rrf_acceleration(Event& event) {
  LimitChange& limits = event.limits.edit();
  limit(event, 'S', 1.0, 0.0, limits.print_accel_mm_s2);
  limits.travel_accel_mm_s2 = limits.print_accel_mm_s2;
  limit(event, 'P', 1.0, 0.0, limits.print_accel_mm_s2);
  limit(event, 'T', 1.0, 0.0, limits.travel_accel_mm_s2);
  raise(limits.print_accel_mm_s2, kMinAccel_mm_s2);
  raise(limits.travel_accel_mm_s2, kMinAccel_mm_s2);
}

// GCodes2.cpp, M205 in mm/s, M566 in mm/min and with the policy P. From 3.6 on M205 sets the jerk
// of prints, which is at most the jerk of M566. M566 sets both (Movement/Move.cpp, SetInstantDv).
void Interpreter::rrf_jerk(Event& event, double scale) {
  axis_limits(event, scale, 0.0, event.limits.edit().axis_jerk_mm_s);
  raise(event.limits.edit().axis_jerk_mm_s, kMinJerk_mm_s);
  if (options_.has_print_jerk && command_.number == 566) {
    event.limits.edit().axis_max_jerk_mm_s = event.limits.edit().axis_jerk_mm_s;
  }
  const std::optional<double> policy = command_.value('P');
  if (command_.number == 566 && policy && *policy >= 0.0) {
    event.limits.edit().jerk_policy = to_int(*policy);
    event.kind = EventKind::limits;
  }
}

// GCodes2.cpp, M220 and M221: a factor is at least one percent.
void Interpreter::rrf_speed_factor(Event& event) {
  if (command_.value('S').value_or(0.0) >= 1.0) {
    state_.speed_factor = *command_.value('S') / 100.0;
  } else if (command_.has('S')) {
    event.warnings.emplace_back("M220 with an invalid S is ignored");
  }
}

void Interpreter::rrf_flow_factor(Event& event) {
  if (command_.value('S').value_or(0.0) >= 1.0) {
    set_flow_of(command_.value('D'), *command_.value('S') / 100.0);
  } else if (command_.has('S')) {
    event.warnings.emplace_back("M221 with an invalid S is ignored");
  }
}

// GCodes2.cpp, M200: without S, on; a diameter of zero takes E as a length.
void Interpreter::rrf_volumetric() {
  if (!command_.has('D') && !command_.has('S')) {
    return;
  }
  const bool on = !command_.has('S') || command_.value('S').value_or(0.0) >= 1.0;
  const double diameter_mm = command_.value('D').value_or(state_.filament_diameter_mm);
  const bool is_volume = on && diameter_mm > 0.0;
  set_volumetric(is_volume, diameter_mm > 0.0 ? diameter_mm : state_.filament_diameter_mm);
}

// Tools/Tool.cpp, SetFirmwareRetraction. T is read after F, and R after S.
void Interpreter::rrf_retraction_settings(Event& event) {
  if (command_.value('P').value_or(tool_.value_or(0)) != tool_.value_or(0)) {
    return;
  }
  constexpr double kLeastSpeed_mm_s = 1.0;  // MinRetractSpeed
  constexpr double kPerMinute = 1.0 / 60.0;
  InterpreterOptions& o = options_;
  o.retract_length_mm = std::max(0.0, command_.value('S').value_or(o.retract_length_mm));
  o.unretract_extra_length_mm =
      std::max(-o.retract_length_mm, command_.value('R').value_or(o.unretract_extra_length_mm));
  if (const auto speed = command_.value('F')) {
    o.retract_speed_mm_s = o.unretract_speed_mm_s = std::max(kLeastSpeed_mm_s, *speed * kPerMinute);
  }
  if (const auto speed = command_.value('T')) {
    o.unretract_speed_mm_s = std::max(kLeastSpeed_mm_s, *speed * kPerMinute);
  }
  if (const auto hop = command_.value('Z')) {
    if (*hop >= 0.0) {
      o.retract_z_hop_mm = *hop;
    } else {
      event.warnings.emplace_back("M207 with an invalid Z is ignored");
    }
  }
}

}  // namespace unflex::gcode
