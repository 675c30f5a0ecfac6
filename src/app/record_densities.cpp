#include "record_densities.hpp"

#include <algorithm>

namespace unflex::app {

Densities densities_of(const identify::DataSet& set) {
  constexpr double kFrom_hz = 15.0;
  constexpr double kTo_hz = 128.0;
  const identify::Spectrum spectrum = spectrum_of(set);
  Densities result{spectrum.step_hz, {}, spectrum.density[0]};
  double most = -1.0;
  for (const std::vector<double>& column : spectrum.density) {
    double energy = 0.0;
    for (std::size_t k = 0; k < column.size(); ++k) {
      const double freq_hz = static_cast<double>(k) * spectrum.step_hz;
      energy += freq_hz > kFrom_hz && freq_hz < kTo_hz ? column[k] : 0.0;
    }
    if (energy > most) {
      most = energy;
      result.column = column;
    }
  }
  for (std::size_t c = 1; c < 3; ++c) {
    for (std::size_t k = 0; k < std::min(result.sum.size(), spectrum.density[c].size()); ++k) {
      result.sum[k] += spectrum.density[c][k];
    }
  }
  return result;
}

}  // namespace unflex::app
