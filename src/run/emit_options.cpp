#include "unflex/run/emit_options.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "base_limits.hpp"
#include "unflex/core/firmware_spec.hpp"
#include "unflex/emit/run_limits.hpp"
#include "unflex/machine/as_printer.hpp"

namespace unflex::run {
namespace {

// The time over which lines are counted, and the shortest line relative to the even pace.
constexpr double kBurst_s = 0.1;
constexpr double kShortest = 0.4;

}  // namespace

emit::EmitOptions emit_options(const machine::Settings& settings, std::string version) {
  emit::EmitOptions options;
  options.interpreter = machine::interpreter_options(settings);
  options.has_free_timing = settings.is_timing_free();
  options.printer_limits = machine::planner_limits(settings);
  options.fixed = machine::firmware_config(settings);
  options.run_limits =
      emit::limits_of_runs(options.fixed, options.printer_limits,
                           {.velocity_mm_s = 2.0 * settings.base_max_velocity_mm_s(),
                            .accel_mm_s2 = settings.emit_accel_mm_s2(),
                            .corner_velocity_mm_s = settings.emit.square_corner_velocity_mm_s});
  options.line_accel_mm_s2 = settings.emit_accel_mm_s2();
  options.pressure = {.is_written = settings.writes_pressure(),
                      .printer_presses = settings.printer_presses(),
                      .hotend = machine::hotend_pressure(settings),
                      .max_accel_mm_s2 = settings.pressure.max_extruder_accel_mm_s2};
  options.lines.tolerance_mm = settings.tolerance_um() * 1e-3;
  // The costs of lines leave out the lead of modes behind each other.
  options.lines.nozzle = machine::nozzle_axes(settings);
  options.lines.field = map_axes(machine::frequency_field, settings.dynamics);
  options.lines.freq_error = settings.freq_error();
  const auto reach = [](const std::optional<machine::Range>& travel) {
    return travel ? emit::Reach{travel->min, travel->max} : emit::Reach{.min_mm = 0.0};
  };
  options.lines.reach = map_axes(reach, settings.printer.travel_mm);
  const FirmwareMotion& motion = spec_of(settings.printer.firmware).motion;
  if (!motion.rounds_to_steps) {
    options.lines.min_line_s = settings.min_line_s();
  } else {
    options.lines.burst_lines = static_cast<int>(settings.max_lines_per_s() * kBurst_s);
    options.lines.burst_s = machine::kClockRoom * kBurst_s;
    options.lines.min_line_s =
        std::max(settings.period_ms() * 1e-3, kShortest / settings.max_lines_per_s());
  }
  if (motion.skips_short_moves) {
    options.lines.min_steps = options.fixed.min_steps_per_segment;
    options.lines.min_line_mm = min_line_mm(settings);
    // With classic jerk as high as in a run, each line begins at its own speed.
    options.lines.leads = !options.fixed.classic_jerk;
  }
  options.lines.first_step_s = planner::first_step_s(options.fixed);
  options.lines.max_speed_step_mm_s = settings.emit.max_speed_step_mm_s;
  options.lines.max_accel_mm_s2 = planned_base_accel_mm_s2(settings, 0.0);
  options.lines.motors = options.fixed.motors;
  options.version = std::move(version);
  options.checkpoints = settings.emit.checkpoints;
  return options;
}

}  // namespace unflex::run
