// Energy spectra by FFT (Eigen's, kissfft inside).
#pragma once

#include <Eigen/Core>
#include <vector>

namespace unflex::identify {

struct EnergySpectrum {
  double step_hz = 0.0;
  Eigen::ArrayXd energy;  // |Y|² at k · step_hz, without the mean
};

// The spectrum of the samples. A few at the end are left out, so that the length is a product of 2,
// 3 and 5. There is no window: in white noise neighbouring values are independent.
[[nodiscard]] EnergySpectrum energy_spectrum(const std::vector<double>& samples, double rate_hz);

}  // namespace unflex::identify
