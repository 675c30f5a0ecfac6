// A hotend as two lags behind a dead time.
//
//   u      power in counts, 0 … full (255 as firmwares count, or 1)
//   K      rise of temperature for each count, °C
//   τ₁     time constant of the block, s
//   τ₂     lag of the sensor, s
//   θ      dead time between heater and block, s
//   T₁     rise of the block, °C
//   T      what the sensor shows, °C
//
//   τ₁ dT₁/dt = K (u(t − θ) − u_load) − T₁
//   τ₂ dT/dt  = T₁ − (T − T_amb)
//
// A first-order lag with dead time cannot oscillate more slowly than with P_u = 4θ at its ultimate
// gain. Hotends do, so that a second lag is needed.
#pragma once

#include <deque>

#include "unflex/core/error.hpp"

namespace unflex::hotend {

// Power of a full duty cycle in the counts of Marlin's and Klipper's gains.
inline constexpr double kFullPower = 255.0;

// Time between two samples of a controller, if nothing else is known. Firmwares take 0.16 to 0.5 s.
inline constexpr double kUsualSample_s = 0.5;

// One lag that acts nearly as the two do.
struct OneLag {
  double time_constant_s = 0.0;
  double dead_time_s = 0.0;
};

// The gain of a proportional controller at which the loop just keeps oscillating, counts per °C,
// and the period of this oscillation.
struct Ultimate {
  double gain = 0.0;
  double period_s = 0.0;
};

struct Plant {
  double gain_c = 0.0;           // K, °C per count
  double time_constant_s = 0.0;  // τ₁
  double sensor_lag_s = 0.0;     // τ₂, may be 0
  double dead_time_s = 0.0;      // θ, may be 0
  double ambient_c = 25.0;
  double full_power = kFullPower;

  // The half rule (Skogestad, Simple analytic rules for model reduction and PID controller tuning,
  // Journal of Process Control 2003, section 2.1): τ = τ₁ + τ₂/2, θ' = θ + τ₂/2.
  [[nodiscard]] OneLag one_lag() const;
  // Rate at which the cold hotend heats at full power, °C/s, by the one lag.
  [[nodiscard]] double heating_rate_c_s() const;
  // The power that holds a temperature.
  [[nodiscard]] double holding_power(double temperature_c) const;
};

// An error of kind input if a value is not finite, negative, or 0 where the plant needs one.
[[nodiscard]] Status check(const Plant& plant);

// Solves the phase equation ωθ + atan ωτ₁ + atan ωτ₂ = π. Half of sample_s is added to θ, since a
// controller holds its power for sample_s. An error of kind input without any dead time, since then
// no gain makes the loop oscillate.
[[nodiscard]] Result<Ultimate> ultimate(const Plant& plant, double sample_s = kUsualSample_s);

// The weights of an exact step of both lags while the power is constant: with c = K u,
//   T₁' = c + block (T₁ − c),   T' = c + sensor (T − c) + cross (T₁ − c),   T counted from ambient.
struct ExactStep {
  double block = 0.0;
  double sensor = 0.0;
  double cross = 0.0;
};
[[nodiscard]] ExactStep exact_step(double time_constant_s, double sensor_lag_s, double step_s);

// Steps a plant through time exactly, whatever the steps are, for power that is constant in each.
class Simulation {
 public:
  // The plant rests at a temperature, with the power that holds it.
  Simulation(const Plant& plant, double temperature_c);

  // Applies a power for step_s. load cools the block, in counts, at once and without the dead time.
  void advance(double power, double step_s, double load = 0.0);

  // The temperature that the sensor shows.
  [[nodiscard]] double temperature_c() const { return plant_.ambient_c + sensor_c_; }

 private:
  struct Change {
    double time_s = 0.0;  // at which the block begins to feel it
    double power = 0.0;
  };

  Plant plant_;
  double now_s_ = 0.0;
  double block_c_ = 0.0;
  double sensor_c_ = 0.0;
  double felt_ = 0.0;  // power that the block feels
  double applied_ = 0.0;
  std::deque<Change> changes_;  // applied but not felt yet
};

// The material that melts, for the heat that a flow of filament takes.
struct Melt {
  double density_g_cm3 = 1.24;  // of PLA
  double heat_j_g_k = 1.8;      // specific heat of PLA, a mean between room and nozzle
};

// ρ c_p Q ΔT in W. PLA at 15 mm³/s through 195 K takes 6.5 W.
[[nodiscard]] double melting_power_w(double flow_mm3_s, double rise_c, const Melt& melt = {});

// A load in W as counts of the plant's power: load_w / (heater_w / full_power). heater_w is what
// the heater gives at full power.
[[nodiscard]] double load_in_counts(const Plant& plant, double load_w, double heater_w);

}  // namespace unflex::hotend
