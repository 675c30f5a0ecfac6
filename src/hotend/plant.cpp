#include "unflex/hotend/plant.hpp"

#include <fmt/core.h>

#include <array>
#include <cmath>
#include <numbers>
#include <string_view>

#include "unflex/core/math.hpp"

namespace unflex::hotend {

OneLag Plant::one_lag() const {
  return {.time_constant_s = time_constant_s + 0.5 * sensor_lag_s,
          .dead_time_s = dead_time_s + 0.5 * sensor_lag_s};
}

double Plant::heating_rate_c_s() const { return gain_c * full_power / one_lag().time_constant_s; }

double Plant::holding_power(double temperature_c) const {
  return (temperature_c - ambient_c) / gain_c;
}

Status check(const Plant& plant) {
  struct Value {
    std::string_view name;
    double value;
    bool may_be_zero;
  };
  const std::array values{
      Value{"gain_c", plant.gain_c, false}, Value{"time_constant_s", plant.time_constant_s, false},
      Value{"sensor_lag_s", plant.sensor_lag_s, true},
      Value{"dead_time_s", plant.dead_time_s, true}, Value{"full power", plant.full_power, false}};
  for (const Value& value : values) {
    const bool fits = value.may_be_zero ? value.value >= 0.0 : value.value > 0.0;
    if (!fits || !std::isfinite(value.value)) {
      return fail(ErrorKind::input,
                  fmt::format("the hotend's {} is {}; give a number {} 0", value.name, value.value,
                              value.may_be_zero ? "of at least" : "above"));
    }
  }
  if (!std::isfinite(plant.ambient_c)) {
    return fail(ErrorKind::input, "the hotend's ambient_c is no number; give one");
  }
  return {};
}

Result<Ultimate> ultimate(const Plant& plant, double sample_s) {
  if (const Status status = check(plant); !status) {
    return tl::unexpected(status.error());
  }
  const double dead_time_s = plant.dead_time_s + 0.5 * sample_s;
  if (dead_time_s <= 0.0) {
    return fail(ErrorKind::input,
                "a hotend without dead time never oscillates, so that it has no ultimate gain; "
                "give dead_time_s");
  }
  const auto phase = [&](double omega) {
    return omega * dead_time_s + math::atan(omega * plant.time_constant_s) +
           math::atan(omega * plant.sensor_lag_s);
  };
  // The phase grows with ω, and the dead time alone has it beyond π at the upper end.
  double low = 0.0;
  double high = std::numbers::pi / dead_time_s;
  constexpr int kHalvings = 100;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    (phase(middle) < std::numbers::pi ? low : high) = middle;
  }
  const double omega = 0.5 * (low + high);
  return Ultimate{.gain = math::hypot(1.0, omega * plant.time_constant_s) *
                          math::hypot(1.0, omega * plant.sensor_lag_s) / plant.gain_c,
                  .period_s = 2.0 * std::numbers::pi / omega};
}

ExactStep exact_step(double time_constant_s, double sensor_lag_s, double step_s) {
  ExactStep step{.block = math::exp(-step_s / time_constant_s)};
  if (sensor_lag_s <= 0.0) {
    step.cross = step.block;
    return step;
  }
  step.sensor = math::exp(-step_s / sensor_lag_s);
  // cross = (block − sensor) / (1 − τ₂/τ₁), which is 0/0 where the lags are equal.
  const double apart = 1.0 / sensor_lag_s - 1.0 / time_constant_s;
  constexpr double kClose = 1e-3;
  if (apart == 0.0) {
    step.cross = step.sensor * step_s / sensor_lag_s;
  } else if (std::abs(step_s * apart) < kClose) {
    step.cross = step.sensor * math::expm1(step_s * apart) / (sensor_lag_s * apart);
  } else {
    step.cross = (step.block - step.sensor) / (sensor_lag_s * apart);
  }
  return step;
}

Simulation::Simulation(const Plant& plant, double temperature_c)
    : plant_(plant),
      block_c_(temperature_c - plant.ambient_c),
      sensor_c_(block_c_),
      felt_(plant.holding_power(temperature_c)),
      applied_(felt_) {}

void Simulation::advance(double power, double step_s, double load) {
  if (power != applied_) {
    changes_.push_back({now_s_ + plant_.dead_time_s, power});
    applied_ = power;
  }
  const double end_s = now_s_ + step_s;
  const auto go_to = [&](double time_s) {
    const ExactStep step = exact_step(plant_.time_constant_s, plant_.sensor_lag_s, time_s - now_s_);
    const double goal_c = plant_.gain_c * (felt_ - load);
    const double off_c = block_c_ - goal_c;
    sensor_c_ = goal_c + step.sensor * (sensor_c_ - goal_c) + step.cross * off_c;
    block_c_ = goal_c + step.block * off_c;
    now_s_ = time_s;
  };
  while (!changes_.empty() && changes_.front().time_s < end_s) {
    go_to(std::max(now_s_, changes_.front().time_s));
    felt_ = changes_.front().power;
    changes_.pop_front();
  }
  go_to(end_s);
}

double melting_power_w(double flow_mm3_s, double rise_c, const Melt& melt) {
  constexpr double kCubicCentimetres = 1e-3;  // in a mm³
  return melt.density_g_cm3 * kCubicCentimetres * melt.heat_j_g_k * flow_mm3_s * rise_c;
}

double load_in_counts(const Plant& plant, double load_w, double heater_w) {
  return load_w / (heater_w / plant.full_power);
}

}  // namespace unflex::hotend
