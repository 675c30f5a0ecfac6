// The excitation of a sweep, and the comparison of measured and fitted values.
#pragma once

#include <Eigen/Core>

#include "unflex/identify/axis_model.hpp"

namespace unflex::identify {

// Energy of the base's acceleration per Hz in a sweep of Klipper's, up to a factor. The sweep is a
// square wave whose amplitude grows with its frequency, and whose frequency grows steadily. Its
// fundamental gives ν². Its odd harmonic n is 1/n as high, comes from an n times lower and weaker
// fundamental, and passes n times as fast. So it adds ν²/n⁵, from n times the sweep's start on.
[[nodiscard]] Eigen::ArrayXd sweep_energy(const Eigen::ArrayXd& freq_hz, double start_hz);

inline constexpr double kQuantile = 1.959964;  // of the normal distribution, 97.5 %

// The estimate with the interval value · exp(± 1.96 σ), where σ belongs to the logarithm.
[[nodiscard]] Estimate estimate_of(double value, double log_variance);

// Widens the interval so that it holds the value.
void widen(Estimate& estimate, double value);

// Compares measured and fitted values, both smoothed: how much of the measurement the fit does not
// explain, and where the measurement has another peak.
struct Misfit {
  double unexplained = 0.0;
  double other_peak_hz = 0.0;  // 0: none worth naming
};
[[nodiscard]] Misfit misfit_of(const Eigen::ArrayXd& freq_hz, const Eigen::ArrayXd& measured,
                               const Eigen::ArrayXd& fitted, double noise, Eigen::Index width);

}  // namespace unflex::identify
