// Source: RepRapFirmware 3.5.3, src/Movement/DDA.cpp (InitStandardMove, VectorBoxIntersection,
// NormaliseLinearMotion, RecalculateMove, PrepParams), src/Config/Configuration.h. Sums and
// products stand in the firmware's order, because floats round.
//
//   u, v, w   speed at the start, at the top and at the end       a, d   acceleration, deceleration
//   s         length
#include <algorithm>
#include <cmath>
#include <functional>

#include "rrf_dda.hpp"

namespace unflex::planner::rrf {
namespace {

using enum gcode::Axis;

constexpr float kShortestRamp = 10.0F;  // MinimumAccelOrDecelClocks

float squared(float value) { return value * value; }

float per_clock(double mm_s, float clock_hz) { return static_cast<float>(mm_s) / clock_hz; }

// F in mm/min as the firmware reads it (GCodeBuffer.cpp, ConvertSpeed). Another order of roundings
// decides whether a ramp of n + ½ clocks takes n or n + 1.
float feed_per_clock(double mm_s, float clock_hz) {
  return static_cast<float>(60.0 * mm_s) * (1.0F / (60.0F * clock_hz));
}

// The factor by which the unit vector grows until it touches the box (VectorBoxIntersection).
float reach(const Vector& direction, const Vector& box) {
  float factor = 0.0F;
  for (const float side : box) factor += side;
  for (std::size_t axis = 0; axis < box.size(); ++axis) {
    const float part = std::abs(direction[axis]);
    if (factor * part > box[axis]) factor = box[axis] / part;
  }
  return factor;
}

// The firmware holds positions of X, Y and Z as floats, and filament as the amount that a move
// takes.
Vector travel(const gcode::Segment& segment) {
  Vector delta{};
  for (const auto axis : gcode::kXYZ) {
    delta[axis] =
        static_cast<float>(segment.end_mm[axis]) - static_cast<float>(segment.start_mm[axis]);
  }
  delta[E] = static_cast<float>(segment.delta(E));
  return delta;
}

// Length in X, Y and Z; of filament where nothing else moves.
float travel_mm(const Vector& delta) {
  const float xyz = std::sqrt(squared(delta[X]) + squared(delta[Y]) + squared(delta[Z]));
  return xyz > 0.0F ? xyz : std::abs(delta[E]);
}

// Removes a ramp that is too short to matter: the faster end's speed becomes the top speed.
// The caller has checked that both ramps fit.
void set_top_speed(Dda& dda) {
  const float u = dda.start_speed;
  const float w = dda.end_speed;
  const float requested = dda.requested_speed;
  const auto nearly_there = [requested](float speed, float accel) {
    return speed + accel * kShortestRamp > requested && speed >= requested * 0.9F;
  };
  dda.top_speed = requested;
  if (u >= w) {
    if (nearly_there(u, dda.accel)) {
      dda.top_speed = u;
      dda.accel_distance_mm = 0.0F;
    }
  } else if (nearly_there(w, dda.decel)) {
    dda.top_speed = w;
    dda.decel_distance_mm = 0.0F;
  }
}

// The whole move is one ramp. Rounding may have made it a little steeper than the limit, or new
// limits of its neighbours much steeper. Its acceleration is then what the ramp needs.
void set_single_ramp(Dda& dda) {
  const float u2 = squared(dda.start_speed);
  const float w2 = squared(dda.end_speed);
  const bool up = dda.start_speed < dda.end_speed;
  dda.accel_distance_mm = up ? dda.length_mm : 0.0F;
  dda.decel_distance_mm = up ? 0.0F : dda.length_mm;
  dda.top_speed = std::max(dda.start_speed, dda.end_speed);
  const float needed = std::abs(w2 - u2) / (2.0F * dda.length_mm);
  // `needed` is 0 if a·s vanishes beside u² in a float. The firmware then gets 0/0 for the ramp's
  // duration, and converts it to 0 clocks.
  if (needed > 0.0F) (up ? dda.accel : dda.decel) = needed;
}

float ramp_clocks(float high, float low, float accel) { return (high - low) / accel; }

// Rounded down. The firmware's 32 bits overflow after 95 minutes. Here a longer move keeps its
// duration, up to eleven years.
std::int64_t whole_clocks(float clocks) {
  constexpr float kMost = 0x1p48F;
  return clocks > 0.0F ? static_cast<std::int64_t>(std::min(clocks, kMost)) : 0;
}

// Whether the axis and the motor of its number do not belong to each other alone, of axes that
// unflex knows (Recalc, HasSharedMotor): another motor turns for the axis, or another motor's
// turning moves the axis.
bool shares_motor(const Motors::Rows& rows, const Motors::Rows& inverse, std::size_t axis) {
  bool is_shared = rows[axis][axis] == 0.0 && inverse[axis][axis] == 0.0;
  for (std::size_t motor = 0; motor < rows.size(); ++motor) {
    is_shared =
        is_shared || (motor != axis && (rows[motor][axis] != 0.0 || inverse[axis][motor] != 0.0));
  }
  return is_shared;
}

// CoreKinematics::LimitSpeedAndAcceleration. The firmware passes it the direction without signs.
void limit_by_motors(const Settings& settings, Dda& dda) {
  const Motors::Rows& rows = settings.motors.rows();
  for (std::size_t motor = 0; motor < rows.size(); ++motor) {
    float part = 0.0F;
    for (const auto axis : gcode::kXYZ) {
      if (settings.shares_motor[axis]) {
        part += static_cast<float>(rows[motor][axis]) * std::abs(dda.direction[axis]);
      }
    }
    part = std::abs(part);
    if (part == 0.0F) continue;
    dda.requested_speed = std::min(dda.requested_speed, settings.max_speed[motor] / part);
    dda.accel = std::min(dda.accel, settings.max_accel[motor] / part);
    dda.decel = std::min(dda.decel, settings.max_accel[motor] / part);
  }
}

}  // namespace

Settings make_settings(const Limits& asked, const FirmwareConfig& config) {
  const Limits limits = rrf_raised(asked);
  Settings result;
  result.motors = config.motors;
  const Motors::Rows inverse = config.motors.inverse();
  for (const auto axis : gcode::kXYZ) {
    result.shares_motor[axis] = shares_motor(config.motors.rows(), inverse, axis);
  }
  const auto clock = static_cast<float>(config.step_clock_hz);
  const float per_clock2 = 1.0F / static_cast<float>(config.step_clock_hz * config.step_clock_hz);
  result.clock_hz = clock;
  result.min_speed = per_clock(limits.min_movement_velocity_mm_s, clock);
  for (std::size_t axis = 0; axis < 4; ++axis) {
    result.max_speed[axis] = per_clock(limits.axis_max_velocity_mm_s[axis], clock);
    result.max_accel[axis] = static_cast<float>(limits.axis_max_accel_mm_s2[axis]) * per_clock2;
    result.allowed_jerk[axis] = per_clock(limits.axis_jerk_mm_s[axis], clock);
  }
  result.print_accel = static_cast<float>(limits.print_accel_mm_s2) * per_clock2;
  result.travel_accel = static_cast<float>(limits.travel_accel_mm_s2) * per_clock2;
  result.join_all = limits.jerk_policy != 0;
  result.rounds_phases = config.rounds_phases;
  return result;
}

bool moves(const gcode::Segment& segment) { return travel_mm(travel(segment)) > 0.0F; }

void start_dda(const Settings& settings, const gcode::Segment& segment, Dda& dda) {
  const Vector delta = travel(segment);
  dda.length_mm = travel_mm(delta);
  const float scale = 1.0F / dda.length_mm;
  for (std::size_t axis = 0; axis < delta.size(); ++axis) dda.direction[axis] = delta[axis] * scale;
  dda.moves_xy = delta[X] != 0.0F || delta[Y] != 0.0F;
  dda.prints = dda.moves_xy && delta[E] > 0.0F;
  dda.extruder_not_print = delta[E] != 0.0F && !dda.prints;

  dda.accel = reach(dda.direction, settings.max_accel);
  if (dda.moves_xy) {
    dda.accel = std::min(dda.accel, dda.prints ? settings.print_accel : settings.travel_accel);
  }
  dda.decel = dda.accel;
  dda.requested_speed =
      std::min(std::max(feed_per_clock(segment.feed_mm_s, settings.clock_hz), settings.min_speed),
               reach(dda.direction, settings.max_speed));
  limit_by_motors(settings, dda);
  dda.start_speed = 0.0F;
  dda.end_speed = 0.0F;
}

void set_trapezoid(Dda& dda) {
  const float two_a = 2.0F * dda.accel;
  const float two_d = 2.0F * dda.decel;
  const float u2 = squared(dda.start_speed);
  const float w2 = squared(dda.end_speed);
  const float requested2 = squared(dda.requested_speed);
  dda.accel_distance_mm = (requested2 - u2) / two_a;
  dda.decel_distance_mm = (requested2 - w2) / two_d;
  if (dda.accel_distance_mm + dda.decel_distance_mm < dda.length_mm) {
    set_top_speed(dda);
  } else {
    // v² from (v² − u²)/2a + (v² − w²)/2d = s.
    const float v2 =
        ((two_a * two_d * dda.length_mm) + (two_a * w2) + two_d * u2) / (two_a + two_d);
    if (v2 > u2 && v2 > w2) {
      dda.accel_distance_mm = (v2 - u2) / two_a;
      dda.decel_distance_mm = (v2 - w2) / two_d;
      dda.top_speed = std::sqrt(v2);
    } else {
      set_single_ramp(dda);
    }
  }
  const float total =
      ramp_clocks(dda.top_speed, dda.start_speed, dda.accel) +
      ramp_clocks(dda.top_speed, dda.end_speed, dda.decel) +
      (dda.length_mm - dda.accel_distance_mm - dda.decel_distance_mm) / dda.top_speed;
  dda.clocks = whole_clocks(total);
}

void finish(const Settings& settings, Dda& dda) {
  const float decel_start_mm = dda.length_mm - dda.decel_distance_mm;
  const float steady_mm = decel_start_mm - std::min(dda.accel_distance_mm, decel_start_mm);
  float accel_clocks = ramp_clocks(dda.top_speed, dda.start_speed, dda.accel);
  float decel_clocks = ramp_clocks(dda.top_speed, dda.end_speed, dda.decel);
  float steady_clocks = steady_mm <= 0.0F ? 0.0F : steady_mm / dda.top_speed;
  if (settings.rounds_phases) {
    // PrepParams::SetFromDDA, lrintf: ties to even, as std::nearbyint here.
    accel_clocks = std::nearbyint(accel_clocks);
    decel_clocks = std::nearbyint(decel_clocks);
    steady_clocks = std::nearbyint(steady_clocks);
  }
  // With less than one clock in all, the longest phase would have to give more than it has.
  dda.clocks = std::max<std::int64_t>(1, whole_clocks(accel_clocks + steady_clocks + decel_clocks));

  const double clock_hz = settings.clock_hz;
  PlannedMove& move = dda.move;
  move.start_v_mm_s = dda.start_speed * clock_hz;
  move.cruise_v_mm_s = dda.top_speed * clock_hz;
  move.end_v_mm_s = dda.end_speed * clock_hz;
  move.accel_mm_s2 = (accel_clocks > 0.0F ? dda.accel : dda.decel) * clock_hz * clock_hz;
  move.accel_s = accel_clocks / clock_hz;
  move.cruise_s = steady_clocks / clock_hz;
  move.decel_s = decel_clocks / clock_hz;
  double& longest =
      std::max({std::ref(move.cruise_s), std::ref(move.decel_s), std::ref(move.accel_s)}).get();
  longest += static_cast<double>(dda.clocks) / clock_hz - move.duration_s();
}

float speed_after(float start_speed, float accel, float length_mm) {
  return std::sqrt(squared(start_speed) + (2.0F * accel * length_mm));
}

}  // namespace unflex::planner::rrf
