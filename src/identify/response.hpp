// What a sweep with a given excitation looks like behind a mode.
#pragma once

#include <Eigen/Core>

#include "unflex/identify/mode.hpp"

namespace unflex::identify {

// |H|² of a mode at frequencies ν, all in Hz.
[[nodiscard]] Eigen::ArrayXd gain_squared(const Eigen::ArrayXd& freq_hz, double mode_hz,
                                          double damping_ratio);

// Energy of the base's acceleration in a sweep of Klipper's, per Hz and to scale: a square wave
// whose amplitude grows with its frequency and whose frequency grows steadily. Its fundamental
// gives ν²; its odd harmonics n are 1/n as high, come from an n times lower and weaker fundamental
// and pass n times as fast: another ν²/n⁵, from n times the sweep's start on.
[[nodiscard]] Eigen::ArrayXd sweep_energy(const Eigen::ArrayXd& freq_hz, double start_hz);

// Frequency, damping and two levels as logarithms, which keeps them positive and of like size.
struct SpectrumParameters {
  double mode_hz = 0.0;
  double damping_ratio = 0.0;
  double scale = 0.0;  // of the sweep's energy
  double noise = 0.0;  // white

  [[nodiscard]] static SpectrumParameters from(const Eigen::VectorXd& logarithms);
  [[nodiscard]] Eigen::VectorXd logarithms() const;
};

// value · exp(± 1.96 σ) of the logarithm, as the estimate.
[[nodiscard]] Estimate estimate_of(double value, double log_variance);

// What is measured and fitted, smoothed: how much of the one the other does not explain, and where
// else it peaks.
struct Misfit {
  double unexplained = 0.0;
  double other_peak_hz = 0.0;  // 0: there is none worth naming
};
[[nodiscard]] Misfit misfit_of(const Eigen::ArrayXd& freq_hz, const Eigen::ArrayXd& measured,
                               const Eigen::ArrayXd& fitted, double noise, Eigen::Index width);

// Remarks on a mode that does not explain what was measured, or lies where the sweep was not.
void add_warnings(const Misfit& misfit, const Sweep& sweep, Mode& mode);

}  // namespace unflex::identify
