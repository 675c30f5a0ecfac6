#include "dialect.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <functional>
#include <utility>
#include <variant>

#include "command_line.hpp"
#include "firmware_dialect.hpp"
#include "unflex/core/firmware_spec.hpp"
#include "unflex/core/own_marks.hpp"
#include "unflex/planner/limit_rows.hpp"

namespace unflex::emit {
namespace {

using planner::Limits;

void forget(const planner::SharedLimit& limit, Limits& limits) {
  limits.*limit.in_force = kUnknown;
}

void forget(const planner::AxisLimit& limit, Limits& limits) {
  (limits.*limit.in_force).fill(kUnknown);
}

void forget(const planner::ChoiceLimit& limit, Limits& limits) {
  constexpr int kNone = -1;
  limits.*limit.in_force = kNone;
}

// Each is unequal to any wanted limit.
Limits unknown_limits() {
  Limits limits;
  for (const planner::LimitRow& row : planner::limit_rows()) {
    std::visit([&](const auto& limit) { forget(limit, limits); }, row.member);
  }
  return limits;
}

}  // namespace

Limits limits_of_runs(const planner::FirmwareConfig& config, Limits limits, const RunLimits& run) {
  dialect_of(config.firmware).set_run_limits(config, run, limits);
  return limits;
}

void set_axis_limits(const RunLimits& run, Limits& limits) {
  for (const gcode::Axis axis : {gcode::X, gcode::Y, gcode::E}) {
    limits.axis_max_accel_mm_s2[axis] = run.accel_mm_s2;
    limits.axis_jerk_mm_s[axis] = run.corner_velocity_mm_s;
    if (axis != gcode::E) {
      limits.axis_max_velocity_mm_s[axis] = run.velocity_mm_s;
    }
  }
  limits.print_accel_mm_s2 = run.accel_mm_s2;
  limits.travel_accel_mm_s2 = run.accel_mm_s2;
}

Limits raised(Limits in_run, double accel_mm_s2) {
  double& x = in_run.axis_max_accel_mm_s2[gcode::X];
  double& y = in_run.axis_max_accel_mm_s2[gcode::Y];
  double& e = in_run.axis_max_accel_mm_s2[gcode::E];
  for (double* limit : {&x, &y, &e, &in_run.print_accel_mm_s2, &in_run.travel_accel_mm_s2,
                        &in_run.max_accel_mm_s2, &in_run.accel_to_decel_mm_s2}) {
    *limit = std::max(*limit, accel_mm_s2);
  }
  return in_run;
}

Limits limits_in_run(Firmware firmware, const Limits& file, Limits raised) {
  if (spec_of(firmware).motion.has_axis_limits) {
    raised.axis_max_velocity_mm_s[gcode::Z] = file.axis_max_velocity_mm_s[gcode::Z];
    raised.axis_max_velocity_mm_s[gcode::E] = file.axis_max_velocity_mm_s[gcode::E];
    raised.axis_max_accel_mm_s2[gcode::Z] = file.axis_max_accel_mm_s2[gcode::Z];
    raised.axis_jerk_mm_s[gcode::Z] = file.axis_jerk_mm_s[gcode::Z];
    raised.axis_max_jerk_mm_s[gcode::Z] = file.axis_max_jerk_mm_s[gcode::Z];
    raised.retract_accel_mm_s2 = file.retract_accel_mm_s2;
  }
  return raised;
}

ZLimits z_limits(const planner::FirmwareConfig& config, const Limits& in_run) {
  if (!spec_of(config.firmware).motion.has_axis_limits) {
    return {config.max_z_velocity_mm_s, config.max_z_accel_mm_s2};
  }
  constexpr double kOfJerk = 0.5;
  return {kOfJerk * in_run.axis_jerk_mm_s[gcode::Z], in_run.axis_max_accel_mm_s2[gcode::Z]};
}

Limits unknown_to_run(Firmware firmware, const Limits& file) {
  return limits_in_run(firmware, file, unknown_limits());
}

std::vector<std::string> limit_lines(const planner::FirmwareConfig& config, const Limits& wanted,
                                     const Limits& current) {
  std::vector<std::string> lines;
  dialect_of(config.firmware).limit_lines(config, wanted, current, lines);
  return lines;
}

std::string unless_interrupted(std::string line) {
  return line.replace(0, kKlipperLimits.size(), kLimitsMacro);
}

std::vector<std::string> shaper_lines(Firmware firmware, const gcode::Shaper& wanted,
                                      const gcode::Shaper& current) {
  std::vector<std::string> lines;
  // What is not known cannot be set.
  ShaperAxes axes =
      map_axes([](bool unknown, bool was_unknown, double freq_hz,
                  double was_hz) { return !unknown && (was_unknown || freq_hz != was_hz); },
               wanted.unknown, current.unknown, wanted.freq_hz, current.freq_hz);
  if (spec_of(firmware).filters.shapes_both_axes_alike) {
    axes.x = !wanted.unknown.x;
  }
  dialect_of(firmware).shaper_lines(wanted, current, axes, lines);
  return lines;
}

std::string advance_line(Firmware firmware, const gcode::PressureAdvance& wanted) {
  const auto own_form = dialect_of(firmware).advance_line;
  return own_form != nullptr ? own_form(wanted)
                             : fmt::format("{}{}", spec_of(firmware).writing.advance_command,
                                           wanted.advance_s.value());
}

std::string unknown_shaper_lines(Firmware firmware, const gcode::Shaper& wanted,
                                 const gcode::Shaper& current) {
  const ShaperAxes axes =
      map_axes([](bool unknown, bool was_unknown) { return unknown && !was_unknown; },
               wanted.unknown, current.unknown);
  return any_axis(std::identity{}, axes) ? dialect_of(firmware).unknown_shaper_lines(axes) : "";
}

}  // namespace unflex::emit
