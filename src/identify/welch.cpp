#include "welch.hpp"

#include <Eigen/Core>
#include <cmath>
#include <unsupported/Eigen/FFT>

#include "unflex/core/math.hpp"
#include "welch_window.hpp"

namespace unflex::identify {
namespace {

Eigen::Index window_length(double rate_hz) {
  constexpr double kShortest_s = 0.5;
  Eigen::Index length = 2;
  while (static_cast<double>(length) < kShortest_s * rate_hz) {
    length *= 2;
  }
  return length;
}

// I₀(x) = Σ ((x/2)ᵏ / k!)², the modified Bessel function of order 0.
double bessel_i0(double x) {
  double term = 1.0;
  double sum = 1.0;
  for (int k = 1; term > 1e-17 * sum; ++k) {
    term *= math::square(0.5 * x / k);
    sum += term;
  }
  return sum;
}

Eigen::ArrayXd kaiser_window(Eigen::Index length) {
  Eigen::ArrayXd window(length);
  for (Eigen::Index i = 0; i < length; ++i) {
    const double x = 2.0 * static_cast<double>(i) / static_cast<double>(length - 1) - 1.0;
    window[i] = bessel_i0(kBetaOfWindow * std::sqrt(std::max(1.0 - x * x, 0.0)));
  }
  return window;
}

}  // namespace

Spectrum as_acceleration(Spectrum spectrum) {
  if (spectrum.is_normalized) {
    for (std::vector<double>& column : spectrum.density) {
      for (std::size_t k = 0; k < column.size(); ++k) {
        column[k] *= static_cast<double>(k) * spectrum.step_hz + 0.1;
      }
    }
    spectrum.is_normalized = false;
  }
  return spectrum;
}

Spectrum spectrum_of(const DataSet& set) {
  Spectrum result;
  if (const auto* recording = std::get_if<Recording>(&set.data)) {
    for (std::size_t c = 0; c < 3; ++c) {
      Spectrum column = welch_spectrum(recording->accel[c], recording->rate_hz);
      result.step_hz = column.step_hz;
      result.density[c] = std::move(column.density[0]);
    }
    return result;
  }
  return as_acceleration(std::get<Spectrum>(set.data));
}

Spectrum welch_spectrum(const std::vector<double>& samples, double rate_hz) {
  const Eigen::Index length = window_length(rate_hz);
  const Eigen::ArrayXd window = kaiser_window(length);
  const Eigen::Map<const Eigen::ArrayXd> all(samples.data(),
                                             static_cast<Eigen::Index>(samples.size()));
  Eigen::FFT<double> fft;
  fft.SetFlag(Eigen::FFT<double>::HalfSpectrum);
  Eigen::ArrayXd sum = Eigen::ArrayXd::Zero(length / 2 + 1);
  for (Eigen::Index at = 0; at + length <= all.size(); at += length / 2) {
    const Eigen::ArrayXd part = all.segment(at, length);
    const Eigen::VectorXd windowed = (window * (part - part.mean())).matrix();
    Eigen::VectorXcd transform;
    fft.fwd(transform, windowed);
    sum += transform.cwiseAbs2().array();
  }
  Spectrum spectrum;
  spectrum.step_hz = rate_hz / static_cast<double>(length);
  spectrum.density[0].assign(sum.begin(), sum.end());
  spectrum.density[1] = spectrum.density[2] = std::vector<double>(spectrum.density[0].size(), 0.0);
  return spectrum;
}

}  // namespace unflex::identify
