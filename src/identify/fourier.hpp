// Energy spectra by FFT (Eigen's, kissfft inside).
#pragma once

#include <Eigen/Core>
#include <vector>

namespace unflex::identify {

struct EnergySpectrum {
  double step_hz = 0.0;
  Eigen::ArrayXd energy;  // |Y|² at k · step_hz, without the mean
};

// Of all samples but the few at the end that make the length a product of 2, 3 and 5. There is no
// window: in white noise neighbouring values are independent.
[[nodiscard]] EnergySpectrum energy_spectrum(const std::vector<double>& samples, double rate_hz);

}  // namespace unflex::identify
