#include "unflex/run/verify_rules.hpp"

#include <algorithm>
#include <optional>

#include "unflex/machine/as_printer.hpp"
#include "unflex/machine/mode_frame.hpp"

namespace unflex::run {
namespace {

// Nozzles of plants: the n-th has the n-th plant of both axes, or the axis as given where it has
// fewer.
std::vector<verify::NozzleModel> nozzles_of_plants(const machine::Settings& settings,
                                                   const verify::NozzleModel& nominal,
                                                   std::size_t count) {
  std::vector<verify::NozzleModel> nozzles(count, nominal);
  for (std::size_t i = 0; i < count; ++i) {
    for_each_axis(
        [&](dynamics::FlexibleAxis& nozzle, const machine::AxisDynamics& axis, double second_hz,
            double second_damping) {
          if (i < axis.plants.size()) {
            nozzle = machine::behind(machine::flexible_axis(axis.plants[i].modes), second_hz,
                                     second_damping);
          }
        },
        nozzles[i], settings.dynamics, settings.second.freq_hz, settings.second.damping_ratio);
  }
  return nozzles;
}

verify::NozzleModel nozzle_of(const machine::Settings& settings) {
  return {machine::nozzle_axes(settings), settings.verify.step_ms * 1e-3, settings.verify.hold_s,
          machine::mode_frame(settings)};
}

verify::AxisChange change_of(const machine::AxisDynamics& axis) {
  verify::AxisChange change{axis.moving_mass_g, {}};
  for (const machine::FrequencyMap& map : axis.map) {
    verify::ShareMap& shares = change.maps.emplace_back();
    shares.along = static_cast<std::size_t>(map.along - 'x');
    shares.at_mm = map.at_mm;
    for (const double freq_hz : map.freq_hz) {
      shares.share.push_back(freq_hz / axis.freq_hz);
    }
  }
  return change;
}

verify::MachineChange machine_change(const machine::Settings& settings) {
  return {map_axes(change_of, settings.dynamics), settings.filament_g_per_mm()};
}

}  // namespace

verify::StepRules step_rules(const machine::Settings& settings) {
  const machine::StepLimits limits = settings.step_limits();
  verify::StepRules rules;
  rules.max_hz = limits.max_hz;
  rules.max_total_hz = limits.max_total_hz;
  rules.max_shared_hz = limits.max_shared_hz;
  for (std::size_t i = 0; i < rules.steps_per_mm.size(); ++i) {
    rules.steps_per_mm[i] = settings.printer.steps_per_mm[i].value_or(0.0);
  }
  return rules;
}

verify::Rules verify_rules(const machine::Settings& settings) {
  verify::Rules rules;
  rules.interpreter = machine::interpreter_options(settings);
  rules.limits = machine::planner_limits(settings);
  rules.fixed = machine::firmware_config(settings);
  const std::size_t plants = most_of_axes(
      [](const machine::AxisDynamics& axis) { return axis.plants.size(); }, settings.dynamics);
  rules.nozzle = nozzle_of(settings);
  rules.plants = nozzles_of_plants(settings, rules.nozzle, plants);
  rules.change = machine_change(settings);
  for (const machine::ToolSettings& tool : settings.tools) {
    const machine::Settings own = machine::with_tool(settings, tool.number);
    const verify::NozzleModel nozzle = nozzle_of(own);
    rules.tools.push_back(
        {tool.number, nozzle, nozzles_of_plants(own, nozzle, plants), machine_change(own)});
  }
  for_each_axis(
      [](const std::optional<machine::Range>& travel, verify::TravelRange& range) {
        range.min_assumed = !travel;
        range.min_mm = travel ? travel->min : 0.0;
        range.max_mm = travel ? travel->max : range.max_mm;
      },
      settings.printer.travel_mm, rules.travel);
  rules.base_max_velocity_mm_s = settings.base_max_velocity_mm_s();
  rules.base_max_accel_mm_s2 = settings.base_max_accel_mm_s2();
  rules.base_accel_times_plan = settings.base_accel_times_asked();
  rules.max_lines_per_s = settings.max_lines_per_s();
  rules.steps = step_rules(settings);
  rules.tolerance_mm = settings.largest_tolerance_um() * 1e-3;
  rules.line.hotend = machine::hotend_pressure(settings);
  rules.line.is_written = settings.writes_pressure();
  rules.line.width_mm = settings.pressure.line_width_mm;
  rules.filament_area_mm2 = settings.filament_area_mm2();
  rules.may_ask_ahead = settings.hotend.ahead;
  rules.max_flow_mm3_s = settings.extruder.max_flow_mm3_s.value_or(rules.max_flow_mm3_s);
  if (machine::grid_mm(settings) > machine::kGrid_mm) {
    constexpr double kShareOfStep = 0.1;
    rules.leeway.chance_mm = kShareOfStep * machine::grid_mm(settings);
  }
  return rules;
}

}  // namespace unflex::run
