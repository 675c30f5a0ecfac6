// A block's rates, speed and acceleration, within the limits of each motor.
//
// Source: Marlin 2.1.2, src/module/planner.cpp, Planner::_populate_block and
// refresh_acceleration_rates.
#include <algorithm>
#include <cmath>
#include <limits>

#include "marlin_block.hpp"
#include "marlin_integers.hpp"
#include "marlin_junction.hpp"

namespace unflex::planner::marlin {
namespace {

using enum gcode::Axis;

Vector to_floats(const std::array<double, 4>& values) {
  Vector result{};
  std::ranges::transform(values, result.begin(), [](double v) { return static_cast<float>(v); });
  return result;
}

std::uint32_t magnitude(std::int64_t steps) {
  return to_unsigned(std::abs(static_cast<double>(steps)));
}

// The motion of a block: of each motor, and of the head.
struct Travel {
  std::array<std::uint32_t, 4> steps{};
  Vector distance_mm{};
  Vector head_mm{};
};

Travel travel(const Settings& settings, const Steps& delta, float e_factor) {
  Travel result;
  for (std::size_t axis = 0; axis < delta.size(); ++axis) {
    result.steps[axis] = magnitude(delta[axis]);
    result.head_mm[axis] = static_cast<float>(delta[axis]) * settings.mm_per_step[axis];
  }
  if (e_factor != 1.0F) {
    const float steps = static_cast<float>(delta[E]) * e_factor;
    result.steps[E] = to_unsigned(std::abs(steps) + 0.5F);
    result.head_mm[E] = steps * settings.mm_per_step[E];
  }
  result.distance_mm = result.head_mm;
  for (std::size_t motor = 0; settings.shares_motors && motor < settings.motors.size(); ++motor) {
    std::int64_t steps = 0;
    float distance_mm = 0.0F;
    for (const auto axis : gcode::kXYZ) {
      const int share = settings.motors[motor][axis];
      steps += share * delta[axis];
      distance_mm += static_cast<float>(share) * result.head_mm[axis];
    }
    result.steps[motor] = magnitude(steps);
    result.distance_mm[motor] = distance_mm;
  }
  return result;
}

// A motion of too few steps in X, Y and Z counts as a move of filament.
float length_mm(const Settings& settings, const Travel& travel) {
  const Vector& d = travel.head_mm;
  if (std::max({travel.steps[X], travel.steps[Y], travel.steps[Z]}) <
      settings.min_steps_per_segment) {
    return std::abs(d[E]);
  }
  return std::sqrt(d[X] * d[X] + d[Y] * d[Y] + d[Z] * d[Z]);
}

// SLOWDOWN: while less than half of the buffer is filled, short blocks are stretched.
float stretched(const Settings& settings, float per_second, std::size_t moves_queued) {
  constexpr float kSecond_us = 1000000.0F;
  if (moves_queued < 2 || moves_queued >= settings.block_buffer_size / 2) return per_second;
  const auto time_us = saturated<std::int64_t>(std::round(kSecond_us / per_second));
  const std::int64_t missing_us = settings.min_segment_time_us - time_us;
  if (missing_us <= 0) return per_second;
  return kSecond_us /
         static_cast<float>(time_us + 2 * missing_us / static_cast<std::int64_t>(moves_queued));
}

// Nominal speed and rate as asked for, then slowed until each motor keeps its limit (M203). Returns
// the speeds of the motors.
Vector limit_speeds(const Settings& settings, const Travel& travel, float per_second,
                    Block& block) {
  block.nominal_speed_mm_s = block.length_mm * per_second;
  const float rate = std::ceil(static_cast<float>(block.step_events) * per_second);
  block.nominal_rate_steps_s = to_unsigned(rate);
  Vector speed_mm_s{};
  float factor = 1.0F;
  for (std::size_t axis = 0; axis < speed_mm_s.size(); ++axis) {
    speed_mm_s[axis] = travel.distance_mm[axis] * per_second;
    const float v = std::abs(speed_mm_s[axis]);
    if (v > settings.max_velocity_mm_s[axis]) {
      factor = std::min(factor, settings.max_velocity_mm_s[axis] / v);
    }
  }
  if (factor < 1.0F) {
    for (float& v : speed_mm_s) v *= factor;
    block.nominal_rate_steps_s =
        to_unsigned(static_cast<float>(block.nominal_rate_steps_s) * factor);
    block.nominal_speed_mm_s *= factor;
  }
  // The firmware divides by the rate, so it must not be 0.
  block.nominal_rate_steps_s = std::max(block.nominal_rate_steps_s, 1U);
  return speed_mm_s;
}

// M204, then M201 for each motor that moves. Filament alone has no limit but M204 R.
void limit_accel(const Settings& settings, const Travel& travel, float inverse_length,
                 Block& block) {
  const float steps_per_mm = static_cast<float>(block.step_events) * inverse_length;
  const bool filament_only = travel.steps[X] == 0 && travel.steps[Y] == 0 && travel.steps[Z] == 0;
  const float asked_mm_s2 = filament_only          ? settings.retract_accel_mm_s2
                            : travel.steps[E] != 0 ? settings.print_accel_mm_s2
                                                   : settings.travel_accel_mm_s2;
  auto accel = to_unsigned(std::ceil(asked_mm_s2 * steps_per_mm));
  for (std::size_t axis = 0; axis < travel.steps.size() && !filament_only; ++axis) {
    const std::uint32_t steps = travel.steps[axis];
    const std::uint32_t limit = settings.max_accel_steps_s2[axis];
    if (steps == 0 || limit >= accel) continue;
    if (block.step_events <= settings.accel_integer_limit_steps) {
      accel = std::min(accel, limit * block.step_events / steps);
      continue;
    }
    const float possible = static_cast<float>(limit) * static_cast<float>(block.step_events) /
                           static_cast<float>(steps);
    if (possible < static_cast<float>(accel)) accel = to_unsigned(possible);
  }
  block.accel_steps_s2 = accel;
  block.accel_mm_s2 = static_cast<float>(accel) / steps_per_mm;
}

}  // namespace

Settings make_settings(const Limits& limits, const FirmwareConfig& config) {
  Settings s;
  const Motors& motors = config.motors;
  for (std::size_t motor = 0; motor < s.motors.size(); ++motor) {
    for (const auto axis : gcode::kXYZ) {
      s.motors[motor][axis] = static_cast<int>(motors.rows()[motor][axis]);
      s.shares_motors = s.shares_motors || (axis != motor && s.motors[motor][axis] != 0);
    }
  }
  s.steps_per_mm = to_floats(config.steps_per_mm);
  s.max_velocity_mm_s = to_floats(limits.axis_max_velocity_mm_s);
  s.jerk_mm_s = to_floats(limits.axis_jerk_mm_s);
  std::uint32_t highest = 1;
  for (std::size_t axis = 0; axis < s.steps_per_mm.size(); ++axis) {
    s.mm_per_step[axis] = 1.0F / s.steps_per_mm[axis];
    s.max_accel_mm_s2[axis] = to_unsigned(limits.axis_max_accel_mm_s2[axis]);
    s.max_accel_steps_s2[axis] =
        to_unsigned(static_cast<float>(s.max_accel_mm_s2[axis]) * s.steps_per_mm[axis]);
    highest = std::max(highest, s.max_accel_steps_s2[axis]);
  }
  s.accel_integer_limit_steps = std::numeric_limits<std::uint32_t>::max() / highest;
  s.print_accel_mm_s2 = static_cast<float>(limits.print_accel_mm_s2);
  s.travel_accel_mm_s2 = static_cast<float>(limits.travel_accel_mm_s2);
  s.retract_accel_mm_s2 = static_cast<float>(limits.retract_accel_mm_s2);
  s.junction_deviation_mm = static_cast<float>(limits.junction_deviation_mm);
  s.min_velocity_mm_s = static_cast<float>(limits.min_velocity_mm_s);
  s.min_travel_velocity_mm_s = static_cast<float>(limits.min_travel_velocity_mm_s);
  s.min_segment_time_us = saturated<std::int32_t>(std::round(limits.min_segment_time_s * 1e6));
  s.minimum_speed_mm_s = static_cast<float>(config.minimum_planner_speed_mm_s);
  s.classic_jerk = config.classic_jerk;
  s.handle_small_segments = config.jd_handle_small_segments;
  s.min_steps_per_segment = static_cast<std::uint32_t>(std::max(config.min_steps_per_segment, 1));
  s.block_buffer_size = static_cast<std::size_t>(std::max(config.block_buffer_size, 4));
  return s;
}

bool populate_block(const Settings& settings, const Request& request, std::size_t moves_queued,
                    Previous& previous, Block& block) {
  const Travel motion = travel(settings, request.delta, request.e_factor);
  block.step_events = *std::ranges::max_element(motion.steps);
  if (block.step_events < settings.min_steps_per_segment) return false;
  block.length_mm = length_mm(settings, motion);

  const bool with_filament = motion.steps[E] != 0;
  const float feed = std::max(request.feed_mm_s, with_filament ? settings.min_velocity_mm_s
                                                               : settings.min_travel_velocity_mm_s);
  const float inverse_length = 1.0F / block.length_mm;
  const float per_second = stretched(settings, inverse_length * feed, moves_queued);
  const Vector speed_mm_s = limit_speeds(settings, motion, per_second, block);
  limit_accel(settings, motion, inverse_length, block);

  const BlockEntry entry{motion.distance_mm, speed_mm_s,       inverse_length,
                         with_filament,      moves_queued > 0, request.curve_radius_mm};
  block.max_entry_v2 = max_entry_v2(settings, block, entry, previous);
  block.entry_v2 = settings.minimum_speed_mm_s * settings.minimum_speed_mm_s;
  block.nominal_length =
      block.nominal_speed_mm_s * block.nominal_speed_mm_s <= reachable_v2(block, block.entry_v2);
  previous.speed_mm_s = speed_mm_s;
  previous.nominal_speed_mm_s = block.nominal_speed_mm_s;
  return true;
}

}  // namespace unflex::planner::marlin
