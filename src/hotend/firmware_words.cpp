#include "unflex/hotend/firmware_words.hpp"

#include <fmt/core.h>

#include <cmath>

#include "unflex/core/math.hpp"

namespace unflex::hotend {
namespace {

// Gives K for a τ, and τ for a K, since K τ = ΔT / (ΔT/100)^E.
double across_power_law(double value, double rise_c, double exponent) {
  return rise_c / (value * math::pow(rise_c / 100.0, exponent));
}

}  // namespace

std::string klipper_words(const Gains& gains, double full_power) {
  const double scale = kFullPower / full_power;
  return fmt::format("pid_kp = {:.3f}\npid_ki = {:.3f}\npid_kd = {:.3f}\n", gains.p * scale,
                     gains.i * scale, gains.d * scale);
}

std::string marlin_words(const Gains& gains, double full_power) {
  const double scale = kFullPower / full_power;
  return fmt::format("M301 P{:.3f} I{:.4f} D{:.3f}", gains.p * scale, gains.i * scale,
                     gains.d * scale);
}

RrfModel rrf_model(const Plant& plant, double working_c) {
  const OneLag one = plant.one_lag();
  return {.heating_rate_c_s = plant.heating_rate_c_s(),
          .cooling_rate_c_s =
              across_power_law(one.time_constant_s, working_c - plant.ambient_c, kRrfExponent),
          .dead_time_s = one.dead_time_s};
}

double time_constant_s(double cooling_rate_c_s, double rise_c, double exponent) {
  return across_power_law(cooling_rate_c_s, rise_c, exponent);
}

std::string rrf_words(const RrfModel& model, int heater) {
  return fmt::format("M307 H{} R{:.3f} K{:.3f} D{:.2f} E{:.2f} S1.00", heater,
                     model.heating_rate_c_s, model.cooling_rate_c_s, model.dead_time_s,
                     kRrfExponent);
}

}  // namespace unflex::hotend
