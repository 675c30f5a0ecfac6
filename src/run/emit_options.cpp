#include "unflex/run/emit_options.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "base_limits.hpp"
#include "unflex/machine/as_printer.hpp"

namespace unflex::run {
namespace {

// The time over which lines are counted, and the shortest line relative to the even pace.
constexpr double kBurst_s = 0.1;
constexpr double kShortest = 0.4;

// The printer's limits inside a compensated run. They leave room above the base's own limits, so
// that the firmware never slows a line down. Z keeps its limits.
planner::Limits run_limits(planner::Limits limits, const machine::Settings& settings) {
  const double velocity = 2.0 * settings.base_max_velocity_mm_s();
  const double accel = settings.emit_accel_mm_s2();
  const double corner = settings.emit.square_corner_velocity_mm_s;
  switch (settings.printer.firmware) {
    case Firmware::klipper:
      limits.max_velocity_mm_s = velocity;
      limits.max_accel_mm_s2 = accel;
      limits.square_corner_velocity_mm_s = corner;
      limits.minimum_cruise_ratio = 0.0;
      limits.accel_to_decel_mm_s2 = accel;
      return limits;
    case Firmware::marlin:
      // The most M205 J takes (Marlin 2.1.2, M200-M205.cpp).
      limits.junction_deviation_mm = 0.3;
      limits.min_velocity_mm_s = 0.0;
      limits.min_travel_velocity_mm_s = 0.0;
      limits.min_segment_time_s = 0.0;
      break;
    case Firmware::rrf:
      limits.jerk_policy = 1;
      limits.min_movement_velocity_mm_s = 0.01;  // AbsoluteMinFeedrate
      for (const gcode::Axis axis : {gcode::X, gcode::Y, gcode::E}) {
        limits.axis_max_jerk_mm_s[axis] = settings.has_print_jerk() ? corner : planner::kNoLimit;
      }
      break;
  }
  for (const gcode::Axis axis : {gcode::X, gcode::Y, gcode::E}) {
    limits.axis_max_accel_mm_s2[axis] = accel;
    limits.axis_jerk_mm_s[axis] = corner;
    if (axis != gcode::E) {
      limits.axis_max_velocity_mm_s[axis] = velocity;
    }
  }
  limits.print_accel_mm_s2 = accel;
  limits.travel_accel_mm_s2 = accel;
  return limits;
}

}  // namespace

emit::EmitOptions emit_options(const machine::Settings& settings, std::string version) {
  emit::EmitOptions options;
  options.interpreter = machine::interpreter_options(settings);
  options.has_free_timing = settings.is_timing_free();
  options.printer_limits = machine::planner_limits(settings);
  options.fixed = machine::firmware_config(settings);
  options.run_limits = run_limits(options.printer_limits, settings);
  options.line_accel_mm_s2 = settings.emit_accel_mm_s2();
  options.pressure = {.is_written = settings.writes_pressure(),
                      .printer_presses = settings.printer_presses(),
                      .hotend = machine::hotend_pressure(settings),
                      .max_accel_mm_s2 = settings.pressure.max_extruder_accel_mm_s2};
  options.lines.tolerance_mm = settings.tolerance_um() * 1e-3;
  // The costs of lines leave out the lead of modes behind each other.
  options.lines.nozzle_x = machine::nozzle_x(settings);
  options.lines.nozzle_y = machine::nozzle_y(settings);
  options.lines.freq_error = settings.freq_error();
  const auto reach = [](const std::optional<machine::Range>& travel) {
    return travel ? emit::Reach{travel->min, travel->max} : emit::Reach{.min_mm = 0.0};
  };
  options.lines.reach_x = reach(settings.printer.travel_x_mm);
  options.lines.reach_y = reach(settings.printer.travel_y_mm);
  if (settings.printer.firmware == Firmware::klipper) {
    options.lines.min_line_s = settings.min_line_s();
  } else {
    options.lines.burst_lines = static_cast<int>(settings.max_lines_per_s() * kBurst_s);
    options.lines.burst_s = machine::kClockRoom * kBurst_s;
    options.lines.min_line_s =
        std::max(settings.period_ms() * 1e-3, kShortest / settings.max_lines_per_s());
  }
  if (settings.printer.firmware == Firmware::marlin) {
    options.lines.min_steps = options.fixed.min_steps_per_segment;
    options.lines.min_line_mm = min_line_mm(settings);
    // With classic jerk as high as in a run, each line begins at its own speed.
    options.lines.leads = !options.fixed.classic_jerk;
  }
  options.lines.first_step_s = planner::first_step_s(options.fixed);
  options.lines.max_speed_step_mm_s = settings.emit.max_speed_step_mm_s;
  options.lines.max_accel_mm_s2 = planned_base_accel_mm_s2(settings, 0.0);
  options.lines.motors = options.fixed.motors();
  options.version = std::move(version);
  options.checkpoints = settings.emit.checkpoints;
  return options;
}

}  // namespace unflex::run
