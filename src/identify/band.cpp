#include "band.hpp"

#include <algorithm>
#include <cmath>

namespace unflex::identify {
namespace {

std::size_t first_bin(const Spectrum& spectrum, const Sweep& sweep) {
  return static_cast<std::size_t>(
      std::ceil(std::max(kFitFrom_hz, 1.2 * sweep.start_hz) / spectrum.step_hz));
}

std::size_t bin_behind(const Spectrum& spectrum, const Sweep& sweep) {
  const auto end = static_cast<std::size_t>(std::max(0.0, 0.965 * sweep.end_hz / spectrum.step_hz));
  return std::min(end, std::ranges::min({spectrum.density[0].size(), spectrum.density[1].size(),
                                         spectrum.density[2].size()}));
}

}  // namespace

AxisDensity density_of_axis(const Spectrum& spectrum, const Sweep& sweep) {
  constexpr double kMajority = 0.6;
  AxisDensity result;
  if (!(spectrum.step_hz > 0.0)) {
    return result;
  }
  const std::size_t first = first_bin(spectrum, sweep);
  const std::size_t end = bin_behind(spectrum, sweep);
  std::array<double, 3> energy{};
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t k = first; k < end; ++k) {
      energy[c] += spectrum.density[c][k];
    }
  }
  const double whole = energy[0] + energy[1] + energy[2];
  if (whole > 0.0) {
    for (std::size_t c = 0; c < 3; ++c) {
      result.direction[c] = std::sqrt(std::max(energy[c], 0.0) / whole);
    }
  }
  const auto most = static_cast<std::size_t>(std::ranges::max_element(energy) - energy.begin());
  if (whole > 0.0 && energy[most] >= kMajority * whole) {
    result.density = spectrum.density[most];
    return result;
  }
  result.most_of_sum = most;
  const std::size_t length = std::ranges::min(
      {spectrum.density[0].size(), spectrum.density[1].size(), spectrum.density[2].size()});
  for (std::size_t k = 0; k < length; ++k) {
    result.density.push_back(spectrum.density[0][k] + spectrum.density[1][k] +
                             spectrum.density[2][k]);
  }
  return result;
}

Result<Band> band_of(const Spectrum& spectrum, const std::vector<double>& density,
                     const Sweep& sweep) {
  constexpr std::size_t kFewest = 25;
  constexpr double kFloor = 0.01;
  constexpr double kNoiseEnds_hz = 30.0;
  constexpr double kFewestAboveNoise = 10.0;
  if (!(spectrum.step_hz > 0.0)) {
    return fail(ErrorKind::input, "its frequencies do not grow");
  }
  const std::size_t first = first_bin(spectrum, sweep);
  const std::size_t end = bin_behind(spectrum, sweep);
  if (end < first + kFewest) {
    return fail(ErrorKind::input, "it has too few frequencies in the band of the sweep");
  }
  const auto count = static_cast<Eigen::Index>(end - first);
  Band band{
      .step_hz = spectrum.step_hz,
      .first = static_cast<Eigen::Index>(first),
      .freq_hz = Eigen::ArrayXd::LinSpaced(count, static_cast<double>(first) * spectrum.step_hz,
                                           static_cast<double>(end - 1) * spectrum.step_hz),
      .density = Eigen::ArrayXd(count)};
  for (std::size_t k = first; k < end; ++k) {
    band.density[static_cast<Eigen::Index>(k - first)] = density[k];
  }
  const double mean = band.density.mean();
  if (!std::isfinite(mean) || !(mean > 0.0)) {
    return fail(ErrorKind::input, "there is no motion in the band of the sweep");
  }
  band.density /= mean;
  // The floor is a share of the swing, whose density is P/ν², without the noise at low frequencies.
  const Eigen::ArrayXd square = band.freq_hz.square();
  const Eigen::ArrayXd is_high = (band.freq_hz > kNoiseEnds_hz).cast<double>();
  if (is_high.sum() < kFewestAboveNoise) {
    return fail(ErrorKind::input, "it has too few frequencies in the band of the sweep");
  }
  band.floor = kFloor * (band.density / square * is_high).sum() / is_high.sum() * square;
  if (!band.logarithms().isFinite().all()) {
    return fail(ErrorKind::input, "it has densities that are no numbers or below 0");
  }
  return band;
}

}  // namespace unflex::identify
