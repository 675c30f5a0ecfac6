// Power spectral density as klippy/extras/shaper_calibrate.py computes it: Welch's method, Kaiser
// windows of half a second and more, half overlapping.
#pragma once

#include <cmath>
#include <complex>
#include <unsupported/Eigen/FFT>
#include <vector>

#include "unflex/identify/record.hpp"

namespace unflex::identify {

inline Spectrum welch(const std::vector<double>& samples, double rate_hz, bool is_normalized) {
  constexpr double kBeta = 6.0;
  constexpr double kHighest_hz = 200.0;
  Eigen::Index length = 1;
  while (static_cast<double>(length) < 0.5 * rate_hz) {
    length *= 2;
  }
  Eigen::VectorXd window(length);
  for (Eigen::Index i = 0; i < length; ++i) {
    const double x = 2.0 * static_cast<double>(i) / static_cast<double>(length - 1) - 1.0;
    window[i] = std::cyl_bessel_i(0.0, kBeta * std::sqrt(1.0 - x * x));
  }
  const Eigen::Map<const Eigen::VectorXd> all(samples.data(),
                                              static_cast<Eigen::Index>(samples.size()));
  Eigen::FFT<double> fft;
  fft.SetFlag(Eigen::FFT<double>::HalfSpectrum);
  Eigen::ArrayXd sum = Eigen::ArrayXd::Zero(length / 2 + 1);
  for (Eigen::Index at = 0; at + length <= all.size(); at += length / 2) {
    const Eigen::VectorXd part = all.segment(at, length);
    const Eigen::VectorXd windowed = window.array() * (part.array() - part.mean());
    Eigen::VectorXcd transform;
    fft.fwd(transform, windowed);
    sum += transform.cwiseAbs2().array();
  }
  Spectrum spectrum;
  spectrum.step_hz = rate_hz / static_cast<double>(length);
  spectrum.is_normalized = is_normalized;
  for (Eigen::Index i = 0; static_cast<double>(i) * spectrum.step_hz < kHighest_hz; ++i) {
    const double freq_hz = static_cast<double>(i) * spectrum.step_hz;
    spectrum.density[0].push_back(is_normalized ? sum[i] / (freq_hz + 0.1) : sum[i]);
  }
  spectrum.density[1] = spectrum.density[2] = spectrum.density[0];
  return spectrum;
}

}  // namespace unflex::identify
