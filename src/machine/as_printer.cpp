#include "unflex/machine/as_printer.hpp"

#include <algorithm>
#include <array>
#include <functional>
#include <numbers>
#include <utility>
#include <vector>

#include "unflex/core/firmware_spec.hpp"
#include "unflex/core/xy.hpp"

namespace unflex::machine {
namespace {

static_assert(kMostModes == dynamics::kMostModes);

// The longest pause for a swing to die away.
constexpr double kLongestCalm_s = 0.5;

// Filament per mm of path, in mm, from which on a move has too much. A firmware that limits the
// extruder refuses such a move. The others lay it, so that only what no nozzle can lay is too much.
double max_extrude_ratio(const Settings& settings) {
  constexpr double kNoNozzle = 5.0;
  const double radius_mm = settings.extruder.filament_diameter_mm / 2.0;
  const double ratio =
      settings.max_extrude_cross_section_mm2() / (std::numbers::pi * radius_mm * radius_mm);
  return settings.spec().motion.limits_extruder ? ratio : kNoNozzle * ratio;
}

}  // namespace

double grid_mm(const Settings& settings) {
  return settings.spec().motion.rounds_to_steps
             ? 1.0 / least_of_axes(std::identity{}, xy_of(settings.steps_per_mm()))
             : kGrid_mm;
}

dynamics::FlexibleAxis flexible_axis(const std::vector<ModeSettings>& settings) {
  std::vector<dynamics::Mode> modes;
  for (const ModeSettings& mode : settings) {
    modes.push_back({2.0 * std::numbers::pi * mode.freq_hz, mode.damping_ratio, mode.gain});
  }
  return dynamics::FlexibleAxis(modes);
}

dynamics::FlexibleAxis flexible_axis(const AxisDynamics& dynamics) {
  return dynamics.modes.empty() ? dynamics::from_frequency(dynamics.freq_hz, dynamics.damping_ratio)
                                : flexible_axis(dynamics.modes);
}

dynamics::FrequencyField frequency_field(const AxisDynamics& dynamics) {
  dynamics::FrequencyField field;
  for (const FrequencyMap& map : dynamics.map) {
    if (map.is_over_bed()) {
      dynamics::SharesAlong& along = map.along == 'x' ? field.x : field.y;
      along.at_mm = map.at_mm;
      for (const double hz : map.freq_hz) {
        along.share.push_back(hz / dynamics.freq_hz);
      }
    }
  }
  return field;
}

dynamics::FlexibleAxis behind(const dynamics::FlexibleAxis& axis, double freq_hz,
                              double damping_ratio) {
  return freq_hz > 0.0 ? axis.followed_by(2.0 * std::numbers::pi * freq_hz, damping_ratio) : axis;
}

Settings with_tool(Settings settings, int number) {
  const std::vector<ToolSettings> tools = std::exchange(settings.tools, {});
  const auto found = std::ranges::find(tools, number, &ToolSettings::number);
  if (found == tools.end()) {
    return settings;
  }
  for_each_axis(
      [](AxisDynamics& axis, const std::optional<double>& freq_hz,
         const std::optional<double>& damping_ratio) {
        if (freq_hz || damping_ratio) {
          axis.modes.clear();
          axis.plants.clear();
        }
        // A map tells shares of freq_hz.
        const double share = freq_hz.value_or(axis.freq_hz) / axis.freq_hz;
        for (FrequencyMap& map : axis.map) {
          for (double& hz : map.freq_hz) {
            hz *= share;
          }
        }
        axis.freq_hz = freq_hz.value_or(axis.freq_hz);
        axis.damping_ratio = damping_ratio.value_or(axis.damping_ratio);
      },
      settings.dynamics, found->freq_hz, found->damping_ratio);
  for_each_axis(
      [&](AxisDynamics& axis) {
        for (FrequencyMap& map : axis.map) {
          const double offset_mm = map.along == 'x'   ? found->offset_mm.x
                                   : map.along == 'y' ? found->offset_mm.y
                                                      : 0.0;
          for (double& place_mm : map.at_mm) {
            place_mm += offset_mm;
          }
        }
      },
      settings.dynamics);
  return settings;
}

// At the place that by_place is for, the product of all maps over the bed is by_place times the
// given frequency. So the first map is divided by by_place once its frequencies have become shares
// of the new frequency.
Settings with_frequencies(Settings settings, const Axes<FrequencyShare>& shares) {
  for_each_axis(
      [](AxisDynamics& axis, double& second_hz, const FrequencyShare& by) {
        const double share = by.by_print * by.by_place;
        std::erase_if(axis.map, [](const FrequencyMap& map) { return !map.is_over_bed(); });
        for (FrequencyMap& map : axis.map) {
          const double times = &map == axis.map.data() ? by.by_print : share;
          for (double& hz : map.freq_hz) {
            hz *= times;
          }
        }
        axis.freq_hz *= share;
        second_hz *= share;
        axis.moving_mass_g = 0.0;
        for (ModeSettings& mode : axis.modes) {
          mode.freq_hz *= share;
        }
        for (PlantSettings& plant : axis.plants) {
          for (ModeSettings& mode : plant.modes) {
            mode.freq_hz *= share;
          }
        }
      },
      settings.dynamics, settings.second.freq_hz, shares);
  return settings;
}

Axes<dynamics::FlexibleAxis> nozzle_axes(const Settings& settings) {
  return map_axes(
      [](const AxisDynamics& axis, double second_hz, double second_damping_ratio) {
        return behind(flexible_axis(axis), second_hz, second_damping_ratio);
      },
      settings.dynamics, settings.second.freq_hz, settings.second.damping_ratio);
}

gcode::InterpreterOptions interpreter_options(const Settings& settings) {
  gcode::InterpreterOptions options = gcode::default_options(settings.printer.firmware);
  options.relative_e = settings.printer.relative_extrusion;
  options.firmware_retraction = settings.printer.firmware_retraction;
  options.retract_length_mm = settings.retract_length_mm();
  options.retract_length_is_told = settings.printer.retract_length_mm.has_value();
  options.retract_speed_mm_s = settings.retract_speed_mm_s();
  options.unretract_extra_length_mm = settings.printer.unretract_extra_length_mm;
  options.unretract_speed_mm_s = settings.unretract_speed_mm_s();
  options.retract_z_hop_mm = settings.printer.retract_z_hop_mm;
  options.arc_resolution_mm = settings.printer.arc_resolution_mm;
  options.marlin_arcs = {
      .min_segment_mm = settings.printer.arcs.min_segment_mm,
      .max_segment_mm = settings.printer.arcs.max_segment_mm,
      .segments_per_s = settings.printer.arcs.segments_per_s,
      .min_circle_segments = static_cast<int>(settings.printer.arcs.min_circle_segments),
      .correction_interval = static_cast<int>(settings.printer.arcs.correction_interval),
      .circles = settings.printer.arcs.p_circles};
  options.shaper_freq_hz = settings.shaper_freq_hz();
  options.shaper_unknown = settings.shaper_unknown();
  options.shaper_type = settings.shaper_type().x;
  options.has_print_jerk = settings.has_print_jerk();
  options.filament_diameter_mm = settings.extruder.filament_diameter_mm;
  options.steps_per_mm = settings.steps_per_mm();
  const auto settling_s = [](const Settings& of) {
    return most_of_axes([](const dynamics::FlexibleAxis& axis) { return axis.settling_s(); },
                        nozzle_axes(of));
  };
  double longest_s = settling_s(settings);
  for (const ToolSettings& tool : settings.tools) {
    options.tools.push_back(tool.number);
    longest_s = std::max(longest_s, settling_s(with_tool(settings, tool.number)));
  }
  options.settling_s = std::min(longest_s, kLongestCalm_s);
  if (settings.writes_pressure() && settings.printer_presses()) {
    options.advance_of_runs = gcode::RunAdvance::on;
    options.begins_advanced = settings.pressure.advance_s.value_or(0.0) > 0.0 ||
                              settings.extruder.pressure_advance_s > 0.0;
  } else if (settings.writes_pressure()) {
    options.advance_of_runs = gcode::RunAdvance::off;
  }
  options.max_extrude_ratio = max_extrude_ratio(settings);
  options.max_extrude_dab_mm = settings.extruder.nozzle_diameter_mm * options.max_extrude_ratio;
  return options;
}

planner::Limits planner_limits(const Settings& settings) {
  planner::Limits limits;
  limits.max_velocity_mm_s = settings.limits.max_velocity_mm_s;
  limits.max_accel_mm_s2 = settings.limits.max_accel_mm_s2;
  limits.square_corner_velocity_mm_s = settings.limits.square_corner_velocity_mm_s;
  limits.minimum_cruise_ratio = settings.limits.minimum_cruise_ratio;
  limits.accel_to_decel_mm_s2 = (1.0 - limits.minimum_cruise_ratio) * limits.max_accel_mm_s2;
  limits.axis_max_velocity_mm_s = settings.axis_max_velocity_mm_s();
  limits.axis_max_accel_mm_s2 = settings.axis_max_accel_mm_s2();
  limits.axis_jerk_mm_s = settings.print_jerk_mm_s();
  if (settings.has_print_jerk()) {
    limits.axis_max_jerk_mm_s = settings.jerk_mm_s();
  }
  limits.print_accel_mm_s2 = settings.print_accel_mm_s2();
  limits.travel_accel_mm_s2 = settings.travel_accel_mm_s2();
  limits.retract_accel_mm_s2 = settings.retract_accel_mm_s2();
  limits.junction_deviation_mm = settings.limits.junction_deviation_mm;
  limits.min_velocity_mm_s = settings.limits.min_velocity_mm_s;
  limits.min_travel_velocity_mm_s = settings.limits.min_travel_velocity_mm_s;
  limits.min_segment_time_s = settings.limits.min_segment_time_ms * 1e-3;
  limits.min_movement_velocity_mm_s = settings.limits.min_movement_velocity_mm_s;
  limits.jerk_policy = static_cast<int>(settings.limits.jerk_policy);
  return planner::as_accepted(settings.printer.firmware, limits);
}

planner::FirmwareConfig firmware_config(const Settings& settings) {
  planner::FirmwareConfig config;
  config.firmware = settings.printer.firmware;
  config.motors = settings.motors();
  config.max_z_velocity_mm_s = settings.axis_max_velocity_mm_s()[gcode::Z];
  config.max_z_accel_mm_s2 = settings.axis_max_accel_mm_s2()[gcode::Z];
  config.max_extrude_only_velocity_mm_s = settings.max_extrude_only_velocity_mm_s();
  config.max_extrude_only_accel_mm_s2 = settings.max_extrude_only_accel_mm_s2();
  config.instantaneous_corner_velocity_mm_s = settings.extruder.instantaneous_corner_velocity_mm_s;
  config.pressure_advance_s = settings.spec().filters.has_linear_advance
                                  ? settings.printer.linear_advance_s
                                  : settings.extruder.pressure_advance_s;
  config.pressure_advance_smooth_s = settings.extruder.pressure_advance_smooth_s;
  config.shaper = {settings.shaper_type(), settings.shaper_damping_ratio()};
  config.steps_per_mm = settings.steps_per_mm();
  config.classic_jerk = settings.printer.junctions.classic_jerk;
  config.min_steps_per_segment = static_cast<int>(settings.printer.junctions.min_steps_per_segment);
  config.jd_handle_small_segments = settings.printer.junctions.handle_small_segments;
  config.minimum_planner_speed_mm_s = settings.printer.junctions.minimum_speed_mm_s;
  config.block_buffer_size = config.ring_length = static_cast<int>(settings.queue_length());
  config.step_clock_hz = settings.printer.step_clock_hz;
  config.has_print_jerk = config.rounds_phases = settings.has_print_jerk();
  return config;
}

dynamics::HotendPressure hotend_pressure(const Settings& settings) {
  using enum dynamics::PressureShape;
  const PressureSettings& set = settings.pressure;
  const auto shape = set.shape == "two_slopes"   ? two_slopes
                     : set.shape == "tanh"       ? tanh
                     : set.shape == "reciprocal" ? reciprocal
                                                 : linear;
  return {.shape = shape,
          .advance_s = set.advance_s.value_or(0.0),
          .offset_mm = set.offset_mm,
          .knee_mm_s = set.knee_mm_s,
          .second_advance_s = set.second_advance_s,
          .dead_time_s = set.dead_time_ms * 1e-3};
}

}  // namespace unflex::machine
