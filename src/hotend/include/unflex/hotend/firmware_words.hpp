// A plant and its gains in the words of each firmware.
#pragma once

#include <string>

#include "unflex/hotend/plant.hpp"
#include "unflex/hotend/rules.hpp"

namespace unflex::hotend {

// "pid_kp = 15.938\npid_ki = 0.375\npid_kd = 37.500\n". Klipper divides each by 255 (heaters.py,
// PID_PARAM_BASE) and integrates conditionally (ControlPID.temperature_update()).
[[nodiscard]] std::string klipper_words(const Gains& gains, double full_power = kFullPower);

// "M301 P15.938 I0.3750 D37.500". Marlin takes counts, and I and D for seconds; it scales them by
// its sampling time itself (M301.cpp, scalePID_i() and scalePID_d()).
[[nodiscard]] std::string marlin_words(const Gains& gains, double full_power = kFullPower);

// RepRapFirmware's own model, of one lag:
//   dT/dt = R u − K (ΔT/100)^E,   u = 0 … 1,   E = 1.35
// since version 3.4 (FOPDT.cpp, FopDt::GetNetHeatingRate()).
struct RrfModel {
  double heating_rate_c_s = 0.0;  // R = K u_max / τ
  double cooling_rate_c_s = 0.0;  // K = ΔT / (τ (ΔT/100)^E), so that it is right at the working ΔT
  double dead_time_s = 0.0;       // D
};
inline constexpr double kRrfExponent = 1.35;  // FOPDT.h, DefaultHotEndHeaterCoolingRateExponent

// working_c: the temperature at which the model shall hold, above the plant's ambient.
[[nodiscard]] RrfModel rrf_model(const Plant& plant, double working_c);

// The time constant of a linear model that loses as much heat at that rise above the ambient
// temperature: τ = ΔT / (K (ΔT/100)^E). cooling_rate_c_s, K: above 0.
[[nodiscard]] double time_constant_s(double cooling_rate_c_s, double rise_c,
                                     double exponent = kRrfExponent);

// "M307 H1 R1.693 K0.267 D6.25 E1.35 S1.00". The firmware chooses its gains by the model.
[[nodiscard]] std::string rrf_words(const RrfModel& model, int heater = 1);

}  // namespace unflex::hotend
