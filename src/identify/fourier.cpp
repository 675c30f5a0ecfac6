#include "fourier.hpp"

#include <complex>
#include <cstddef>
#include <unsupported/Eigen/FFT>

namespace unflex::identify {
namespace {

bool has_small_factors(std::size_t number) {
  for (const std::size_t factor : {2U, 3U, 5U}) {
    while (number % factor == 0) {
      number /= factor;
    }
  }
  return number == 1;
}

}  // namespace

EnergySpectrum energy_spectrum(const std::vector<double>& samples, double rate_hz) {
  std::size_t length = samples.size() - samples.size() % 2;
  while (!has_small_factors(length)) {
    length -= 2;
  }
  const Eigen::Map<const Eigen::VectorXd> all(samples.data(), static_cast<Eigen::Index>(length));
  const Eigen::VectorXd centred = all.array() - all.mean();
  Eigen::FFT<double> fft;
  fft.SetFlag(Eigen::FFT<double>::HalfSpectrum);
  Eigen::VectorXcd spectrum;
  fft.fwd(spectrum, centred);
  return {.step_hz = rate_hz / static_cast<double>(length), .energy = spectrum.cwiseAbs2()};
}

}  // namespace unflex::identify
