#include "stage_options.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include "step_rates.hpp"
#include "unflex/compensate/band.hpp"
#include "unflex/core/math.hpp"
#include "unflex/dynamics/flexible_axis.hpp"
#include "unflex/planner/rrf_planner.hpp"

namespace unflex::pipeline {
namespace {

// Rounding a line's ends to the grid changes the acceleration from line to line by up to 4 · ½ ·
// grid / T². Rounding F and the firmware's ramps change it by a little more. The optimiser stays
// that far below the limit, so that the text keeps it.
constexpr double kGridMm = 1e-4;
constexpr double kAccelShare = 0.98;
// Where the timing is free the base is at its limit most of the time, so the largest of many errors
// counts.
constexpr double kAccelShareOfFreeTiming = 0.93;
// The time over which lines are counted, and the shortest line relative to the even pace.
constexpr double kBurst_s = 0.1;
constexpr double kShortest = 0.4;

double grid_mm(const machine::Settings& settings) {
  const std::array<double, 4> steps_per_mm = settings.steps_per_mm();
  return settings.printer.firmware != Firmware::klipper
             ? 1.0 / std::min(steps_per_mm[gcode::X], steps_per_mm[gcode::Y])
             : kGridMm;
}

// The speed at which the move takes as much filament as the hotend melts, with some room, as the
// nozzle may be 2 % ahead for a moment.
double speed_by_flow(const planner::PlannedMove& move, const machine::Settings& settings) {
  constexpr double kRoom = 0.98;
  constexpr double kLeast_mm_s = 1.0;
  const std::optional<double> max_flow_mm3_s = settings.extruder.max_flow_mm3_s;
  if (!max_flow_mm3_s || !move.segment.extruding()) {
    return planner::kNoLimit;
  }
  return std::max(
      kRoom * *max_flow_mm3_s / (move.direction[gcode::E] * settings.filament_area_mm2()),
      kLeast_mm_s);
}

timing::MoveBounds free_bounds(const planner::PlannedMove& move, const machine::Settings& settings,
                               const planner::Limits& limits,
                               const planner::FirmwareConfig& config) {
  const gcode::Segment& segment = move.segment;
  timing::MoveBounds bounds = timing::bounds_by_axes(move, limits, config);
  // What the nozzle may run ahead of its limit (timing::kKeptFeed) is left free in travel.
  constexpr double kOfTravel = 0.985;
  const double feed_mm_s = segment.extruding()
                               ? segment.feed_mm_s
                               : settings.timing.max_speed_mm_s.value_or(segment.feed_mm_s);
  const double by_flow_mm_s = speed_by_flow(move, settings);
  bounds.nozzle_speed_mm_s = segment.extruding() ? by_flow_mm_s : kOfTravel * feed_mm_s;
  bounds.speed_mm_s = std::min({bounds.speed_mm_s, feed_mm_s, by_flow_mm_s});
  if (settings.timing.keep_accel_limits && move.accel_mm_s2 > 0.0) {
    bounds.accel_mm_s2 = std::min(bounds.accel_mm_s2, move.accel_mm_s2);
  }
  return bounds;
}

// The move is no faster anywhere than it was sliced.
timing::MoveBounds bounds_as_sliced(const planner::PlannedMove& move) {
  return {.speed_mm_s = move.cruise_v_mm_s,
          .accel_mm_s2 = move.accel_mm_s2 > 0.0 ? move.accel_mm_s2 : planner::kNoLimit,
          .start_speed_mm_s = move.start_v_mm_s,
          .end_speed_mm_s = move.end_v_mm_s};
}

static_assert(machine::kMostModes == dynamics::kMostModes);

dynamics::FlexibleAxis axis(const std::vector<machine::ModeSettings>& settings) {
  std::vector<dynamics::Mode> modes;
  for (const machine::ModeSettings& mode : settings) {
    modes.push_back({2.0 * std::numbers::pi * mode.freq_hz, mode.damping_ratio, mode.gain});
  }
  return dynamics::FlexibleAxis(modes);
}

dynamics::FlexibleAxis axis(const machine::AxisDynamics& dynamics) {
  return dynamics.modes.empty() ? dynamics::from_frequency(dynamics.freq_hz, dynamics.damping_ratio)
                                : axis(dynamics.modes);
}

// The axis with the second mode behind it, if there is one.
dynamics::FlexibleAxis behind(const dynamics::FlexibleAxis& axis, double freq_hz,
                              double damping_ratio) {
  return freq_hz > 0.0 ? axis.followed_by(2.0 * std::numbers::pi * freq_hz, damping_ratio) : axis;
}

bool shares_motors(const machine::Settings& settings) {
  return Motors(settings.kinematics.type, settings.printer.firmware).shared_by_xy();
}

// The acceleration that the largest change of speed from line to line allows the base.
double accel_by_lines(const machine::Settings& settings) {
  return grid_mm(settings) <= kGridMm
             ? machine::kSpeedStepShare *
                   std::max(settings.emit.max_speed_step_mm_s, settings.least_speed_step_mm_s()) /
                   settings.min_line_s()
             : std::numeric_limits<double>::infinity();
}

// The shortest line that Marlin makes, along X or Y. Rounding may take a step off either end.
double min_line_mm(const machine::Settings& settings) {
  return settings.printer.firmware == Firmware::marlin
             ? (settings.printer.min_steps_per_segment + 1.0) * grid_mm(settings)
             : 0.0;
}

// The largest acceleration at which the lines can follow a base that turns round. It goes as far as
// the shortest line in the time of a line, at²/2. A quicker base turns where no line ends.
double accel_by_turns(const machine::Settings& settings, double asked_mm_s2) {
  // The base leads the nozzle, so it needs more than the sliced moves ask for.
  constexpr double kLeast = 1.4;
  const double shortest_mm = min_line_mm(settings);
  const double line_s = settings.min_line_s();
  return shortest_mm > 0.0 && !settings.is_timing_free()
             ? std::max(2.0 * shortest_mm / (line_s * line_s), kLeast * asked_mm_s2)
             : std::numeric_limits<double>::infinity();
}

// The acceleration that the base may have so that the text stays within the limits. There is a
// limit of acceleration and, if lines end on a fine grid, one of the change of speed from line to
// line. Whole steps of a motor are too coarse for the second.
double planned_base_accel(const machine::Settings& settings, double asked_mm_s2,
                          bool for_turns = true) {
  const double shortest_s = settings.min_line_s();
  const double by_turns =
      for_turns ? accel_by_turns(settings, asked_mm_s2) : std::numeric_limits<double>::infinity();
  const double limit =
      std::min({settings.base_max_accel_mm_s2(asked_mm_s2), accel_by_lines(settings), by_turns});
  const double axes =
      shares_motors(settings) ? 2.0 : 1.0;  // number of axes whose rounding a motor gets
  const double share = settings.is_timing_free() ? kAccelShareOfFreeTiming : kAccelShare;
  return share * limit -
         std::min(2.0 * axes * grid_mm(settings) / (shortest_s * shortest_s), 0.2 * limit);
}

// The longest pause for a swing to die away.
constexpr double kLongestCalm_s = 0.5;

// All models that the axis may have besides the one it is given as: the plants of the settings or
// a mode that nobody knows of, and the edges of the band around that one, which share with it what
// the others leave.
std::vector<compensate::Plant> plants(const machine::AxisDynamics& dynamics,
                                      const machine::Settings& settings) {
  const compensate::Band band{settings.freq_error(), settings.dynamics_error.damping};
  const dynamics::FlexibleAxis given = axis(dynamics);
  std::vector<compensate::Plant> result;
  double left = 1.0;
  for (const machine::PlantSettings& plant : dynamics.plants) {
    result.push_back({axis(plant.modes), plant.share});
    left -= plant.share;
  }
  if (!band.is_exact() && dynamics.plants.empty() && dynamics.modes.empty()) {
    result.push_back(compensate::with_unknown_mode(given));
    left -= result.back().share;
  }
  std::ranges::copy(compensate::edges(given, band, left), std::back_inserter(result));
  return result;
}

// Pulses against a mode that hangs behind the axis.
dynamics::ShaperPulses pulses_of(const machine::Settings& settings, double freq_hz,
                                 double damping_ratio) {
  using dynamics::ShaperKind;
  constexpr std::pair<std::string_view, ShaperKind> kKinds[] = {{"zv", ShaperKind::zv},
                                                                {"mzv", ShaperKind::mzv},
                                                                {"zvd", ShaperKind::zvd},
                                                                {"ei", ShaperKind::ei}};
  for (const auto& [name, kind] : kKinds) {
    if (freq_hz > 0.0 && name == settings.second.shaper) {
      return dynamics::shaper_pulses(kind, freq_hz,
                                     std::min(damping_ratio, dynamics::max_damping_ratio(kind)))
          .value();
    }
  }
  return {};
}

compensate::AxisSetup axis_setup(const machine::AxisDynamics& dynamics,
                                 const std::optional<machine::Range>& travel,
                                 const machine::Settings& settings) {
  compensate::AxisSetup setup;
  setup.axis = axis(dynamics);
  setup.plants = plants(dynamics, settings);
  setup.limits.max_velocity_mm_s = settings.base_max_velocity_mm_s();
  setup.limits.max_accel_mm_s2 = planned_base_accel(settings, 0.0);
  if (settings.base.max_jerk_mm_s3 > 0.0) {
    setup.limits.max_jerk_mm_s3 =
        settings.base.max_jerk_mm_s3 / (shares_motors(settings) ? 2.0 : 1.0);
  }
  if (travel) {
    setup.limits.min_position_mm = travel->min;
    setup.limits.max_position_mm = travel->max;
  }
  return setup;
}

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

double half_period_s(const machine::Settings& settings) {
  return 0.5 / std::min(settings.dynamics_x.slowest_hz(), settings.dynamics_y.slowest_hz());
}

// An error of the nozzle that may be seen in a print.
constexpr double kSeen_mm = 10e-3;

// Whether the nozzle still swings from the motion before when the run begins.
bool begins_swinging(const Piece& run, const dynamics::NozzleXY& nozzle,
                     const machine::Settings& settings) {
  const verify::NozzleModel model{nozzle_x(settings), nozzle_y(settings)};
  return run.begins_run() &&
         verify::swing_mm(nozzle, run.moves.front().segment.start_mm, model) >= kSeen_mm;
}

// Whether the run soon lays filament.
bool draws_soon(const Piece& run, const machine::Settings& settings) {
  double start_s = 0.0;
  for (const planner::PlannedMove& move : run.moves) {
    if (start_s > half_period_s(settings) || move.segment.extruding()) {
      return start_s <= half_period_s(settings);
    }
    start_s += move.duration_s();
  }
  return false;
}

// A nozzle that accelerates out of a rest needs its base ahead by the lag, at once. Returns how
// long the base takes to get there, from rest to rest. Returns 0 where nobody would see what is
// missing: the run begins with travel, or straight and with axes that lag alike, or the lag is
// small.
double time_ahead_s(const Piece& run, const compensate::Setup& setup, double soon_s) {
  constexpr double kStraight = 0.999;  // cosine of the angle
  const planner::PlannedMove& first = run.moves.front();
  if (!first.segment.extruding()) {
    return 0.0;
  }
  const double x = first.direction[gcode::X];
  const double y = first.direction[gcode::Y];
  const auto lag_mm = [&](const compensate::AxisSetup& axis, double share) {
    return axis.axis.largest_lag_mm(first.accel_mm_s2 * std::abs(share), 0.0);
  };
  const double lag_x_mm = lag_mm(setup.x, x);
  const double lag_y_mm = lag_mm(setup.y, y);
  double seen_mm = std::abs(lag_x_mm * std::abs(y) - lag_y_mm * std::abs(x));
  double start_s = first.duration_s();
  for (std::size_t i = 1; i < run.moves.size() && start_s < soon_s; ++i) {
    const auto& next = run.moves[i].direction;
    if (x * next[gcode::X] + y * next[gcode::Y] < kStraight) {
      seen_mm = math::hypot(lag_x_mm, lag_y_mm);
    }
    start_s += run.moves[i].duration_s();
  }
  return seen_mm > kSeen_mm ? 2.0 * std::sqrt(std::max(lag_x_mm / setup.x.limits.max_accel_mm_s2,
                                                       lag_y_mm / setup.y.limits.max_accel_mm_s2))
                            : 0.0;
}

// Filament per mm of path, in mm, from which on a move has too much. Klipper refuses such a move.
// The others lay it, so that only what no nozzle can lay is too much.
double max_extrude_ratio(const machine::Settings& settings) {
  constexpr double kNoNozzle = 5.0;
  const double radius_mm = settings.extruder.filament_diameter_mm / 2.0;
  const double ratio =
      settings.max_extrude_cross_section_mm2() / (std::numbers::pi * radius_mm * radius_mm);
  return settings.printer.firmware == Firmware::klipper ? ratio : kNoNozzle * ratio;
}

// The nozzle of each plant: the n-th of both axes, or the axis as given where it has fewer.
std::vector<verify::NozzleModel> nozzles_of_plants(const machine::Settings& settings,
                                                   const verify::NozzleModel& nominal) {
  const std::vector<machine::PlantSettings>& x = settings.dynamics_x.plants;
  const std::vector<machine::PlantSettings>& y = settings.dynamics_y.plants;
  const machine::SecondSettings& second = settings.second;
  std::vector<verify::NozzleModel> nozzles(std::max(x.size(), y.size()), nominal);
  for (std::size_t i = 0; i < nozzles.size(); ++i) {
    if (i < x.size()) {
      nozzles[i].x = behind(axis(x[i].modes), second.x_freq_hz, second.x_damping_ratio);
    }
    if (i < y.size()) {
      nozzles[i].y = behind(axis(y[i].modes), second.y_freq_hz, second.y_damping_ratio);
    }
  }
  return nozzles;
}

}  // namespace

dynamics::FlexibleAxis nozzle_x(const machine::Settings& settings) {
  return behind(axis(settings.dynamics_x), settings.second.x_freq_hz,
                settings.second.x_damping_ratio);
}

dynamics::FlexibleAxis nozzle_y(const machine::Settings& settings) {
  return behind(axis(settings.dynamics_y), settings.second.y_freq_hz,
                settings.second.y_damping_ratio);
}

gcode::InterpreterOptions interpreter_options(const machine::Settings& settings) {
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
      .min_segment_mm = settings.printer.min_arc_segment_mm,
      .max_segment_mm = settings.printer.max_arc_segment_mm,
      .segments_per_s = settings.printer.arc_segments_per_s,
      .min_circle_segments = static_cast<int>(settings.printer.min_circle_segments),
      .correction_interval = static_cast<int>(settings.printer.arc_correction_interval),
      .circles = settings.printer.arc_p_circles};
  options.shaper_freq_x_hz = settings.shaper_freq_x_hz();
  options.shaper_freq_y_hz = settings.shaper_freq_y_hz();
  options.shaper_unknown_x = settings.shaper_unknown_x();
  options.shaper_unknown_y = settings.shaper_unknown_y();
  options.shaper_type = settings.shaper_type_x();
  options.has_print_jerk = settings.has_print_jerk();
  options.filament_diameter_mm = settings.extruder.filament_diameter_mm;
  options.steps_per_mm = settings.steps_per_mm();
  const double settling_s =
      std::max(nozzle_x(settings).settling_s(), nozzle_y(settings).settling_s());
  options.settling_s = std::min(settling_s, kLongestCalm_s);
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

planner::Limits planner_limits(const machine::Settings& settings) {
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
  return settings.printer.firmware == Firmware::rrf ? planner::rrf_raised(limits) : limits;
}

planner::FirmwareConfig firmware_config(const machine::Settings& settings) {
  planner::FirmwareConfig config;
  config.firmware = settings.printer.firmware;
  config.kinematics = settings.kinematics.type;
  config.max_z_velocity_mm_s = settings.axis_max_velocity_mm_s()[gcode::Z];
  config.max_z_accel_mm_s2 = settings.axis_max_accel_mm_s2()[gcode::Z];
  config.max_extrude_only_velocity_mm_s = settings.max_extrude_only_velocity_mm_s();
  config.max_extrude_only_accel_mm_s2 = settings.max_extrude_only_accel_mm_s2();
  config.instantaneous_corner_velocity_mm_s = settings.extruder.instantaneous_corner_velocity_mm_s;
  config.pressure_advance_s = config.firmware == Firmware::marlin
                                  ? settings.printer.linear_advance_s
                                  : settings.extruder.pressure_advance_s;
  config.pressure_advance_smooth_s = settings.extruder.pressure_advance_smooth_s;
  config.shaper = {settings.shaper_type_x(), settings.shaper_type_y(),
                   settings.shaper_damping_ratio_x(), settings.shaper_damping_ratio_y()};
  config.steps_per_mm = settings.steps_per_mm();
  config.classic_jerk = settings.printer.classic_jerk;
  config.min_steps_per_segment = static_cast<int>(settings.printer.min_steps_per_segment);
  config.jd_handle_small_segments = settings.printer.jd_handle_small_segments;
  config.minimum_planner_speed_mm_s = settings.printer.minimum_planner_speed_mm_s;
  config.block_buffer_size = config.ring_length = static_cast<int>(settings.queue_length());
  config.step_clock_hz = settings.printer.step_clock_hz;
  config.has_print_jerk = config.rounds_phases = settings.has_print_jerk();
  return config;
}

compensate::Setup compensate_setup(const machine::Settings& settings) {
  compensate::Setup setup;
  setup.x = axis_setup(settings.dynamics_x, settings.printer.travel_x_mm, settings);
  setup.y = axis_setup(settings.dynamics_y, settings.printer.travel_y_mm, settings);
  setup.x.pulses = pulses_of(settings, settings.second.x_freq_hz, settings.second.x_damping_ratio);
  setup.y.pulses = pulses_of(settings, settings.second.y_freq_hz, settings.second.y_damping_ratio);
  setup.shares_motors = shares_motors(settings);
  setup.period_s = settings.period_ms() * 1e-3;
  setup.lead_in_s = settings.solve.lead_in_ms * 1e-3;
  setup.tail_s = settings.tail_s();
  setup.window_s = settings.solve.window_s;
  setup.overlap_s = std::clamp(std::max(setup.x.axis.unseen_s(), setup.y.axis.unseen_s()),
                               settings.solve.overlap_s, settings.solve.window_s);
  setup.travel_weight = settings.solve.travel_weight;
  setup.jerk_weight = settings.jerk_weight();
  // What swings at the end of a run, travel before a wall for instance, is drawn by the next.
  constexpr double kEndWeight = 10.0;
  setup.end_weight = kEndWeight;
  if (settings.along_weight() < 1.0) {
    // A motion that is free along the path takes longer to settle than one that is not.
    constexpr double kLeastOverlap_s = 0.2;
    setup.overlap_s = std::min(std::max(setup.overlap_s, kLeastOverlap_s), setup.window_s);
    setup.contour = compensate::Contour{.along_weight = settings.along_weight(),
                                        .tracking_jerk_weight = settings.tracking_jerk_weight(),
                                        .pairs = compensate::pairs_of(setup.x, setup.y)};
  }
  return setup;
}

RunSetup setup_for(const compensate::Setup& setup, const Piece& run,
                   const dynamics::NozzleXY& nozzle, const machine::Settings& settings) {
  RunSetup result;
  result.setup = setup;
  for (const planner::PlannedMove& move : run.moves) {
    result.asked_accel_mm_s2 =
        std::max(result.asked_accel_mm_s2, std::round(planner::asked_accel_mm_s2(move)));
  }
  // To end a swing takes all that the motors give.
  const bool swings = begins_swinging(run, nozzle, settings);
  result.accel = {planned_base_accel(settings, result.asked_accel_mm_s2, !swings),
                  settings.emit_accel_mm_s2(result.asked_accel_mm_s2)};
  result.accel_by_lines_mm_s2 = accel_by_lines(settings);
  for (compensate::AxisSetup* const axis : {&result.setup.x, &result.setup.y}) {
    axis->limits.max_accel_mm_s2 = result.accel.base_mm_s2;
  }
  const auto keep_above_zero = [&](gcode::Axis axis, const std::optional<machine::Range>& travel,
                                   compensate::BaseLimits& limits) {
    const bool above = std::ranges::all_of(run.moves, [&](const planner::PlannedMove& move) {
      return move.segment.start_mm[axis] >= 0.0 && move.segment.end_mm[axis] >= 0.0;
    });
    if (!travel && above) {
      limits.min_position_mm = 0.0;
    }
  };
  keep_above_zero(gcode::X, settings.printer.travel_x_mm, result.setup.x.limits);
  keep_above_zero(gcode::Y, settings.printer.travel_y_mm, result.setup.y.limits);
  if (run.begins_run()) {
    const double half_s = half_period_s(settings);
    const double swing_s = swings && draws_soon(run, settings) ? half_s : 0.0;
    // The plan begins at a node, where its acceleration may leap.
    const double nodes = std::ceil(time_ahead_s(run, result.setup, half_s) / setup.period_s);
    result.setup.lead_in_s = std::max({result.setup.lead_in_s, swing_s, nodes * setup.period_s});
  }
  return result;
}

std::vector<timing::MoveBounds> move_bounds(const Piece& run, const machine::Settings& settings) {
  const planner::FirmwareConfig config = firmware_config(settings);
  const planner::Limits limits = planner_limits(settings);
  std::vector<timing::MoveBounds> bounds;
  for (std::size_t event = 0; event < run.move_counts.size(); ++event) {
    for (std::size_t count = run.move_counts[event]; count > 0; --count) {
      const planner::PlannedMove& move = run.moves[bounds.size()];
      const gcode::FeatureKind kind =
          move.segment.extruding() ? run.features[event] : gcode::FeatureKind::travel;
      timing::MoveBounds own = settings.timing.is_free(kind)
                                   ? free_bounds(move, settings, limits, config)
                                   : bounds_as_sliced(move);
      own.tolerance_mm = settings.timing.tolerance_of_um(kind) * 1e-3;
      bounds.push_back(own);
    }
  }
  return bounds;
}

std::optional<timing::Extruder> extruder_of(const Piece& run, const emit::EmitOptions& options,
                                            const machine::TimingSettings& timing) {
  const dynamics::HotendPressure hotend = emit::hotend_of(options, run.start.advance);
  if (!options.pressure.is_written || hotend.advance_s == 0.0 || timing.width_tolerance == 0.0) {
    return std::nullopt;
  }
  return timing::Extruder{hotend, options.pressure.max_accel_mm_s2, timing.width_tolerance};
}

// An advance of 0 is that of the file, or the printer's.
dynamics::HotendPressure hotend_pressure(const machine::Settings& settings) {
  using enum dynamics::PressureShape;
  const machine::PressureSettings& set = settings.pressure;
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

emit::EmitOptions emit_options(const machine::Settings& settings, std::string version) {
  emit::EmitOptions options;
  options.interpreter = interpreter_options(settings);
  options.has_free_timing = settings.is_timing_free();
  options.printer_limits = planner_limits(settings);
  options.fixed = firmware_config(settings);
  options.run_limits = run_limits(options.printer_limits, settings);
  options.line_accel_mm_s2 = settings.emit_accel_mm_s2();
  options.pressure = {.is_written = settings.writes_pressure(),
                      .printer_presses = settings.printer_presses(),
                      .hotend = hotend_pressure(settings),
                      .max_accel_mm_s2 = settings.pressure.max_extruder_accel_mm_s2};
  options.lines.tolerance_mm = settings.tolerance_um() * 1e-3;
  // The costs of lines leave out the lead of modes behind each other.
  options.lines.nozzle_x = nozzle_x(settings);
  options.lines.nozzle_y = nozzle_y(settings);
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
  options.lines.max_accel_mm_s2 = planned_base_accel(settings, 0.0);
  options.lines.motors = options.fixed.motors();
  options.version = std::move(version);
  options.checkpoints = settings.emit.checkpoints;
  return options;
}

verify::Rules verify_rules(const machine::Settings& settings) {
  verify::Rules rules;
  rules.interpreter = interpreter_options(settings);
  rules.limits = planner_limits(settings);
  rules.fixed = firmware_config(settings);
  rules.nozzle = {nozzle_x(settings), nozzle_y(settings), settings.verify.step_ms * 1e-3,
                  settings.verify.hold_s};
  rules.plants = nozzles_of_plants(settings, rules.nozzle);
  const auto set_range = [](const std::optional<machine::Range>& travel, double& min, double& max,
                            bool& min_assumed) {
    min_assumed = !travel;
    min = travel ? travel->min : 0.0;
    max = travel ? travel->max : max;
  };
  set_range(settings.printer.travel_x_mm, rules.travel.x_min_mm, rules.travel.x_max_mm,
            rules.travel.x_min_assumed);
  set_range(settings.printer.travel_y_mm, rules.travel.y_min_mm, rules.travel.y_max_mm,
            rules.travel.y_min_assumed);
  rules.base_max_velocity_mm_s = settings.base_max_velocity_mm_s();
  rules.base_max_accel_mm_s2 = settings.base_max_accel_mm_s2();
  rules.base_accel_times_plan = settings.base_accel_times_asked();
  rules.max_lines_per_s = settings.max_lines_per_s();
  rules.steps = step_rules(settings);
  rules.tolerance_mm = settings.largest_tolerance_um() * 1e-3;
  rules.line.hotend = hotend_pressure(settings);
  rules.line.is_written = settings.writes_pressure();
  rules.line.width_mm = settings.pressure.line_width_mm;
  rules.filament_area_mm2 = settings.filament_area_mm2();
  rules.may_ask_ahead = settings.hotend.ahead;
  rules.max_flow_mm3_s = settings.extruder.max_flow_mm3_s.value_or(rules.max_flow_mm3_s);
  if (grid_mm(settings) > kGridMm) {
    constexpr double kShareOfStep = 0.1;
    rules.leeway.chance_mm = kShareOfStep * grid_mm(settings);
  }
  return rules;
}

}  // namespace unflex::pipeline
