// Notation of the header, and k, T_i, T_d of the ideal form; λ is the closed loop's time constant.
// Where a rule wants one lag, τ and θ' are those of the half rule, and r = θ'/τ.
//
// clang-format off
// Skogestad, Simple analytic rules for model reduction and PID controller tuning,
//   Journal of Process Control 13 (2003): k = τ₁ / (K (λ + θ)), T_i = min(τ₁, 4(λ + θ)),
//   T_d = τ₂ in the series form, with λ = θ. f = 1 + T_d/T_i makes the ideal form of it:
//   k f, T_i f, T_d/f (eq. 36).
// Cohen and Coon, Theoretical consideration of retarded control,
//   Transactions of the ASME 75 (1953).
// Ziegler and Nichols, Optimum settings for automatic controllers,
//   Transactions of the ASME 64 (1942).
// Tyreus and Luyben, Tuning PI controllers for integrator/dead time processes,
//   Industrial & Engineering Chemistry Research 31 (1992); with the derivative of
//   Luyben and Luyben, Essentials of Process Control (1997).
// clang-format on
#include "unflex/hotend/rules.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace unflex::hotend {
namespace {

constexpr std::array<std::pair<Rule, std::string_view>, 6> kNames{{{Rule::simc_pid, "simc"},
                                                                   {Rule::simc_pi, "simc-pi"},
                                                                   {Rule::zn_pid, "zn"},
                                                                   {Rule::zn_pi, "zn-pi"},
                                                                   {Rule::cohen_coon, "cc"},
                                                                   {Rule::tyreus_luyben, "tl"}}};

Gains from_ideal(double k, double integral_s, double derivative_s) {
  return {.p = k, .i = k / integral_s, .d = k * derivative_s};
}

Gains simc_pid(const Plant& plant) {
  const double k = plant.time_constant_s / (2.0 * plant.gain_c * plant.dead_time_s);
  const double integral_s = std::min(plant.time_constant_s, 8.0 * plant.dead_time_s);
  const double factor = 1.0 + plant.sensor_lag_s / integral_s;
  return {.p = k * factor, .i = k / integral_s, .d = k * plant.sensor_lag_s};
}

Gains simc_pi(const Plant& plant) {
  const auto [tau_s, theta_s] = plant.one_lag();
  return from_ideal(tau_s / (2.0 * plant.gain_c * theta_s), std::min(tau_s, 8.0 * theta_s), 0.0);
}

Gains cohen_coon(const Plant& plant) {
  const auto [tau_s, theta_s] = plant.one_lag();
  const double r = theta_s / tau_s;
  return from_ideal(tau_s * (4.0 / 3.0 + r / 4.0) / (plant.gain_c * theta_s),
                    theta_s * (32.0 + 6.0 * r) / (13.0 + 8.0 * r),
                    4.0 * theta_s / (11.0 + 2.0 * r));
}

}  // namespace

std::string_view to_string(Rule rule) {
  return std::ranges::find(kNames, rule, &std::pair<Rule, std::string_view>::first)->second;
}

Result<Gains> gains(Rule rule, const Plant& plant) {
  if (const Status status = check(plant); !status) {
    return tl::unexpected(status.error());
  }
  if (plant.dead_time_s <= 0.0) {
    return fail(ErrorKind::input,
                "without a dead time no rule bounds the gains; give dead_time_s, or log the "
                "temperature more often");
  }
  switch (rule) {
    case Rule::simc_pid:
      return simc_pid(plant);
    case Rule::simc_pi:
      return simc_pi(plant);
    case Rule::cohen_coon:
      return cohen_coon(plant);
    default:
      return ultimate(plant).and_then([&](const Ultimate& found) { return gains(rule, found); });
  }
}

Result<Gains> gains(Rule rule, const Ultimate& ultimate) {
  if (!(ultimate.gain > 0.0 && ultimate.period_s > 0.0) ||
      !std::isfinite(ultimate.gain * ultimate.period_s)) {
    return fail(ErrorKind::input,
                fmt::format("ultimate gain {} and period {} s must both be above 0; give what the "
                            "test with a proportional controller showed",
                            ultimate.gain, ultimate.period_s));
  }
  switch (rule) {
    case Rule::zn_pid:
      return from_ideal(0.6 * ultimate.gain, 0.5 * ultimate.period_s, 0.125 * ultimate.period_s);
    case Rule::zn_pi:
      return from_ideal(0.45 * ultimate.gain, ultimate.period_s / 1.2, 0.0);
    case Rule::tyreus_luyben:
      return from_ideal(ultimate.gain / 2.2, 2.2 * ultimate.period_s, ultimate.period_s / 6.3);
    default:
      return fail(ErrorKind::usage,
                  fmt::format("the rule '{}' needs a model of the hotend, not only its ultimate "
                              "cycle; give a log, or choose zn or tl",
                              to_string(rule)));
  }
}

}  // namespace unflex::hotend
