#include "unflex/hotend/firmware_words.hpp"

#include <fmt/core.h>

#include <cmath>

namespace unflex::hotend {

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
  const double rise_c = working_c - plant.ambient_c;
  return {
      .heating_rate_c_s = plant.heating_rate_c_s(),
      .cooling_rate_c_s = rise_c / (one.time_constant_s * std::pow(rise_c / 100.0, kRrfExponent)),
      .dead_time_s = one.dead_time_s};
}

std::string rrf_words(const RrfModel& model, int heater) {
  return fmt::format("M307 H{} R{:.3f} K{:.3f} D{:.2f} E{:.2f} S1.00", heater,
                     model.heating_rate_c_s, model.cooling_rate_c_s, model.dead_time_s,
                     kRrfExponent);
}

}  // namespace unflex::hotend
