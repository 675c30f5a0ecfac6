#include "unflex/run/setup.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <memory>
#include <numbers>
#include <utility>

#include "base_limits.hpp"
#include "unflex/compensate/band.hpp"
#include "unflex/core/math.hpp"
#include "unflex/dynamics/flexible_axis.hpp"
#include "unflex/machine/as_printer.hpp"
#include "unflex/machine/mode_frame.hpp"
#include "unflex/verify/verify.hpp"

namespace unflex::run {
namespace {

// All models of the axis besides the given one. These are the plants of the settings or a model
// with an unknown mode, and the edges of the band around the given model. The edges share with the
// given model the share that the others leave.
std::vector<compensate::Plant> plants(const machine::AxisDynamics& dynamics,
                                      const machine::Settings& settings) {
  const compensate::Band band{settings.freq_error(), settings.dynamics_error.damping};
  const dynamics::FlexibleAxis given = machine::flexible_axis(dynamics);
  std::vector<compensate::Plant> result;
  double left = 1.0;
  for (const machine::PlantSettings& plant : dynamics.plants) {
    result.push_back({machine::flexible_axis(plant.modes), plant.share});
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

// How much more than an axis a mode asks of the motors that move it: β₀ and β₁ move X and Y by Φ.
double times_by_modes(const dynamics::ModeFrame* frame) {
  double most = 1.0;
  for (std::size_t mode = 0; frame != nullptr && mode < XY::kCount; ++mode) {
    most =
        std::max(most, std::abs(frame->to_axes()[0][mode]) + std::abs(frame->to_axes()[1][mode]));
  }
  return most;
}

// The motors by the modes that they move: G Φ.
compensate::ModeMotors motors_of(const dynamics::ModeFrame& frame, const Motors& motors) {
  compensate::ModeMotors result;
  for (std::size_t i = 0; i < Motors::kCount; ++i) {
    for (std::size_t mode = 0; mode < Motors::kCount; ++mode) {
      const auto& to_axes = frame.to_axes();
      result.by_modes[i][mode] = motors.of(i, to_axes[0][mode], to_axes[1][mode], to_axes[2][mode]);
    }
  }
  return result;
}

// How much the motors move per motion of a mode alone.
double gain_of_mode(const compensate::ModeMotors& motors, std::size_t mode) {
  double most = 0.0;
  for (const auto& motor : motors.by_modes) {
    most = std::max(most, std::abs(motor[mode]));
  }
  return most;
}

// Sets the limits of acceleration of all modes, where Z swings too.
void limit_modes(double max_accel_mm_s2, compensate::Setup& setup) {
  // Lines are cut for X and Y, and Z comes with them. This share of the limit leaves room for what
  // Z then asks of the motors beyond the base.
  constexpr double kShareOfBase = 0.95;
  max_accel_mm_s2 *= kShareOfBase;
  setup.motors->max_accel_mm_s2 = max_accel_mm_s2;
  const std::array<compensate::AxisSetup*, 3> modes = {&setup.x, &setup.y, &*setup.third};
  for (std::size_t i = 0; i < modes.size(); ++i) {
    modes[i]->limits.max_accel_mm_s2 = max_accel_mm_s2 / gain_of_mode(*setup.motors, i);
  }
}

compensate::AxisSetup setup_of_mode(const dynamics::Mode& mode, const machine::Settings& settings) {
  compensate::AxisSetup axis;
  axis.axis = dynamics::FlexibleAxis(mode.omega_rad_s, mode.zeta);
  axis.plants = plants({.freq_hz = axis.axis.main_hz(), .damping_ratio = mode.zeta}, settings);
  return axis;
}

// The share of the firmware's acceleration of Z that the base may ask for. The rest is for lines,
// which change their speed at once.
constexpr double kShareOfZ = 0.9;

// Sets X and Y of the setup to the modes of the machine, and the third mode if Z is not rigid.
// Where the base may go is not limited: verification sees to it that it stays within the travel.
void take_modes(const dynamics::ModeFrame& frame, const machine::Settings& settings,
                compensate::Setup& setup) {
  const double times = times_by_modes(&frame);
  for (std::size_t i = 0; i < XY::kCount; ++i) {
    compensate::AxisSetup axis = setup_of_mode(*frame.mode(i), settings);
    axis.limits = setup[i].limits;
    axis.limits.min_position_mm = -std::numeric_limits<double>::infinity();
    axis.limits.max_position_mm = std::numeric_limits<double>::infinity();
    axis.limits.max_velocity_mm_s /= times;
    axis.limits.max_accel_mm_s2 /= times;
    axis.limits.max_jerk_mm_s3 /= times;
    setup[i] = axis;
  }
  if (frame.mode(2)) {
    setup.third = setup_of_mode(*frame.mode(2), settings);
    setup.third->limits.max_jerk_mm_s3 = setup.x.limits.max_jerk_mm_s3;
    setup.motors = motors_of(frame, settings.motors());
    setup.motors->max_velocity_mm_s = settings.base_max_velocity_mm_s();
    setup.motors->max_z_accel_mm_s2 = kShareOfZ * settings.axis_max_accel_mm_s2()[gcode::Z];
    const std::array<compensate::AxisSetup*, 3> modes = {&setup.x, &setup.y, &*setup.third};
    for (std::size_t i = 0; i < modes.size(); ++i) {
      modes[i]->limits.max_velocity_mm_s =
          setup.motors->max_velocity_mm_s / gain_of_mode(*setup.motors, i);
    }
    limit_modes(planned_base_accel_mm_s2(settings, 0.0), setup);
    setup.shares_motors = false;
  }
  setup.contour.reset();
  setup.jerk_weight = settings.tracking_jerk_weight();
  setup.frame = std::make_shared<dynamics::ModeFrame>(frame);
}

compensate::AxisSetup axis_setup(const machine::AxisDynamics& dynamics,
                                 const std::optional<machine::Range>& travel,
                                 const machine::Settings& settings) {
  compensate::AxisSetup setup;
  setup.axis = machine::flexible_axis(dynamics);
  setup.field = machine::frequency_field(dynamics);
  setup.plants = plants(dynamics, settings);
  const Motors motors = settings.motors();
  setup.limits.max_velocity_mm_s = settings.base_max_velocity_mm_s() / motors.gain_of_xy();
  setup.limits.max_accel_mm_s2 = planned_base_accel_mm_s2(settings, 0.0) / motors.gain_of_xy();
  if (settings.base.max_jerk_mm_s3 > 0.0) {
    setup.limits.max_jerk_mm_s3 = settings.base.max_jerk_mm_s3 / motors.gain_of_both();
  }
  if (travel) {
    setup.limits.min_position_mm = travel->min;
    setup.limits.max_position_mm = travel->max;
  }
  return setup;
}

double half_period_s(const machine::Settings& settings) {
  return 0.5 / least_of_axes([](const machine::AxisDynamics& axis) { return axis.slowest_hz(); },
                             settings.dynamics);
}

// An error of the nozzle that may be seen in a print.
constexpr double kSeen_mm = 10e-3;

// Whether the nozzle still swings from the motion before when the run begins.
bool begins_swinging(const Piece& run, const dynamics::NozzleXY& nozzle,
                     const compensate::Setup& setup, const machine::Settings& settings) {
  verify::NozzleModel model{machine::nozzle_axes(settings)};
  if (setup.frame) {
    model.frame = *setup.frame;
  }
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
  const XY direction = xy_of(first.direction);
  const XY shares = map_axes([](double part) { return std::abs(part); }, direction);
  const XY lag_mm = map_axes(
      [&](const compensate::AxisSetup& axis, double share) {
        return axis.axis.largest_lag_mm(first.accel_mm_s2 * share, 0.0);
      },
      setup, shares);
  double seen_mm = std::abs(cross(lag_mm, shares));
  double start_s = first.duration_s();
  for (std::size_t i = 1; i < run.moves.size() && start_s < soon_s; ++i) {
    if (dot(direction, xy_of(run.moves[i].direction)) < kStraight) {
      seen_mm = length(lag_mm);
    }
    start_s += run.moves[i].duration_s();
  }
  const double slowest_s2 = most_of_axes(
      [](double lag, const compensate::AxisSetup& axis) {
        return lag / axis.limits.max_accel_mm_s2;
      },
      lag_mm, setup);
  return seen_mm > kSeen_mm ? 2.0 * std::sqrt(slowest_s2) : 0.0;
}

}  // namespace

compensate::Setup compensate_setup(const machine::Settings& settings) {
  compensate::Setup setup;
  for_each_axis(
      [&](compensate::AxisSetup& axis, const machine::AxisDynamics& dynamics,
          const std::optional<machine::Range>& travel, double second_hz, double second_damping) {
        axis = axis_setup(dynamics, travel, settings);
        axis.pulses = pulses_of(settings, second_hz, second_damping);
      },
      setup, settings.dynamics, settings.printer.travel_mm, settings.second.freq_hz,
      settings.second.damping_ratio);
  setup.shares_motors = shares_motors(settings);
  setup.period_s = settings.period_ms() * 1e-3;
  setup.lead_in_s = settings.solve.lead_in_ms * 1e-3;
  setup.tail_s = settings.tail_s();
  setup.window_s = settings.solve.window_s;
  const double unseen_s =
      most_of_axes([](const compensate::AxisSetup& axis) { return axis.axis.unseen_s(); }, setup);
  setup.overlap_s = std::clamp(unseen_s, settings.solve.overlap_s, settings.solve.window_s);
  setup.travel_weight = settings.solve.travel_weight;
  setup.jerk_weight = settings.jerk_weight();
  // A swing at the end of a run, of travel before a wall for instance, shows in the lines of the
  // next run.
  constexpr double kEndWeight = 10.0;
  setup.end_weight = kEndWeight;
  if (settings.along_weight() < 1.0) {
    // A motion that is free along the path takes longer to settle than one that is not.
    constexpr double kLeastOverlap_s = 0.2;
    setup.overlap_s = std::min(std::max(setup.overlap_s, kLeastOverlap_s), setup.window_s);
    setup.contour = compensate::Contour{.along_weight = settings.along_weight(),
                                        .tracking_jerk_weight = settings.tracking_jerk_weight(),
                                        .pairs = compensate::pairs_of(setup)};
  }
  if (const std::optional<dynamics::ModeFrame> frame = machine::mode_frame(settings)) {
    take_modes(*frame, settings, setup);
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
  const bool swings = begins_swinging(run, nozzle, setup, settings);
  result.accel = {planned_base_accel_mm_s2(settings, result.asked_accel_mm_s2, !swings),
                  settings.emit_accel_mm_s2(result.asked_accel_mm_s2)};
  result.accel_by_lines_mm_s2 = accel_by_lines_mm_s2(settings);
  const double gain = settings.motors().gain_of_xy() * times_by_modes(setup.frame.get());
  for_each_axis(
      [&](compensate::AxisSetup& axis) {
        axis.limits.max_accel_mm_s2 = result.accel.base_mm_s2 / gain;
      },
      result.setup);
  if (result.setup.third) {
    limit_modes(result.accel.base_mm_s2, result.setup);
  }
  for (std::size_t axis = 0; axis < XY::kCount; ++axis) {
    const bool above = std::ranges::all_of(run.moves, [&](const planner::PlannedMove& move) {
      return move.segment.start_mm[axis] >= 0.0 && move.segment.end_mm[axis] >= 0.0;
    });
    if (!settings.printer.travel_mm[axis] && above && !setup.frame) {
      result.setup[axis].limits.min_position_mm = 0.0;
    }
  }
  if (run.begins_run()) {
    const double half_s = half_period_s(settings);
    // Three modes have to get ahead of the nozzle together, within Z's own limits. A straight
    // begin does not help: it moves the nozzle in Z, too.
    const bool is_slow = swings || result.setup.third;
    const double times = result.setup.third ? 2.0 : 1.0;
    const double swing_s = is_slow && draws_soon(run, settings) ? times * half_s : 0.0;
    // The plan begins at a node, where its acceleration may leap.
    const double nodes = std::ceil(time_ahead_s(run, result.setup, half_s) / setup.period_s);
    result.setup.lead_in_s = std::max({result.setup.lead_in_s, swing_s, nodes * setup.period_s});
  }
  return result;
}

}  // namespace unflex::run
