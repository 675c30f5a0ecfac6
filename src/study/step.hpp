// The nozzle's motion after a step of the base. The step is plain, or the staircase that a shaper
// makes of it.
#pragma once

#include <array>
#include <optional>
#include <string_view>
#include <vector>

#include "unflex/dynamics/flexible_axis.hpp"
#include "unflex/dynamics/shapers.hpp"

namespace unflex::study {

// The base jumps by each pulse's weight at its time, in all by 1 mm; the first jump is at 0. The
// nozzle rests at 0 before.
//
// A jump of b by Δ moves a nozzle with a damper at once: ∫ 2ζω ḃ dt gives it the velocity 2ζω Δ.
// Between jumps it moves by dynamics::exact_step.
class Staircase {
 public:
  // An axis of one mode, and the shaper's pulses, whose weights are the jumps in mm.
  Staircase(double omega_rad_s, double zeta, dynamics::ShaperPulses pulses);

  [[nodiscard]] double base_mm(double time_s) const;
  [[nodiscard]] dynamics::NozzleMotion nozzle(double time_s) const;
  [[nodiscard]] double last_s() const { return pulses_.back().time_s; }
  // Amplitude of the swing about 1 mm with which the nozzle is left by the last jump, mm: a free
  // swing is this times e^{−ζωt} cos(ω_d t + φ), ω_d = ω √(1 − ζ²).
  [[nodiscard]] double left_mm() const;

 private:
  double omega_rad_s_;
  double zeta_;
  dynamics::ShaperPulses pulses_;
};

struct StepRow {
  std::string_view shaper;  // "none", "ZV", "MZV", "ZVD"
  double zeta = 0.0;
  double overshoot = 0.0;           // how far the nozzle passes its target, as a share of the step
  std::optional<double> settled_s;  // from then on it stays within 5 %; nullopt: it never does
  double left = 0.0;                // Staircase::left_mm() as a share of the step
  double left_off = 0.0;  // the larger of those with the frequency 10 % lower and 10 % higher
};

// Natural frequency and damping ratios of the table and its figure.
inline constexpr double kStepOmega_rad_s = 100.0;
inline constexpr std::array<double, 3> kStepZetas = {0.0, 0.1, 0.5};

// A base of the table, with its name.
struct NamedStaircase {
  std::string_view shaper;
  Staircase staircase;
};

// The four bases of the table for a damping ratio. freq_factor: the true frequency over the one
// that the shapers are made for.
[[nodiscard]] std::vector<NamedStaircase> staircases(double zeta, double freq_factor = 1.0);

// How the nozzle follows the staircase, looked at every 0.05 ms; without left_off.
[[nodiscard]] StepRow step_row(const Staircase& staircase);

// The rows of all bases and all damping ratios.
[[nodiscard]] std::vector<StepRow> step_table();

}  // namespace unflex::study
