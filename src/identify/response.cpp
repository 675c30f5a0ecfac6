#include "response.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "unflex/core/math.hpp"

namespace unflex::identify {
namespace {

// Moving mean over `width` values.
Eigen::ArrayXd smoothed(const Eigen::ArrayXd& values, Eigen::Index width) {
  Eigen::ArrayXd result(values.size());
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    const Eigen::Index from = std::max<Eigen::Index>(0, i - width / 2);
    const Eigen::Index to = std::min(values.size(), i + width / 2 + 1);
    result[i] = values.segment(from, to - from).mean();
  }
  return result;
}

}  // namespace

Eigen::ArrayXd sweep_energy(const Eigen::ArrayXd& freq_hz, double start_hz) {
  constexpr std::array kHarmonics = {3.0, 5.0};
  Eigen::ArrayXd energy = freq_hz.square();
  for (const double n : kHarmonics) {
    energy += (freq_hz > n * start_hz).select(freq_hz.square() / math::power(n, 5), 0.0);
  }
  return energy;
}

Estimate estimate_of(double value, double log_variance) {
  const double factor = math::exp(kQuantile * std::sqrt(std::max(log_variance, 0.0)));
  return {.value = value, .low = value / factor, .high = value * factor};
}

void widen(Estimate& estimate, double value) {
  estimate.low = std::min(estimate.low, value);
  estimate.high = std::max(estimate.high, value);
}

Misfit misfit_of(const Eigen::ArrayXd& freq_hz, const Eigen::ArrayXd& measured,
                 const Eigen::ArrayXd& fitted, double noise, Eigen::Index width) {
  const Eigen::ArrayXd seen = smoothed(measured, width);
  const Eigen::ArrayXd told = smoothed(fitted, width);
  const double signal = (seen - noise).max(0.0).sum();
  Misfit misfit;
  misfit.unexplained =
      signal > 0.0 ? std::min(1.0, (seen - told).abs().sum() / (signal + told.sum()) * 2.0) : 1.0;
  // A second peak stands well out of what the mode leaves there.
  constexpr double kShareOfHighest = 0.15;
  constexpr double kTimesFitted = 2.0;
  const double highest = seen.maxCoeff();
  double worst = 0.0;
  for (Eigen::Index i = width; i + width < seen.size(); ++i) {
    const double excess = seen[i] - told[i];
    if (seen[i] > kShareOfHighest * highest && seen[i] > kTimesFitted * told[i] && excess > worst) {
      worst = excess;
      misfit.other_peak_hz = freq_hz[i];
    }
  }
  return misfit;
}

}  // namespace unflex::identify
