#include "log_histogram.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace unflex::verify {
namespace {

constexpr double kSmallest = 1e-9;
constexpr double kLogRatio = 0.00995033085316808285;  // ln 1.01
constexpr std::size_t kCells = 2546;                  // ln(1e2 / 1e-9) / ln 1.01, rounded up

}  // namespace

void add_to_histogram(std::vector<double>& histogram, double value, double weight) {
  if (histogram.empty()) {
    histogram.resize(kCells);
  }
  const double cell = value > kSmallest ? std::log(value / kSmallest) / kLogRatio : 0.0;
  histogram[std::min(static_cast<std::size_t>(cell), kCells - 1)] += weight;
}

double histogram_quantile(const std::vector<double>& histogram, double fraction) {
  const double target = fraction * std::accumulate(histogram.begin(), histogram.end(), 0.0);
  double weight = 0.0;
  for (std::size_t cell = 0; cell < histogram.size(); ++cell) {
    weight += histogram[cell];
    if (weight > 0.0 && weight >= target) {
      return kSmallest * std::exp((static_cast<double>(cell) + 0.5) * kLogRatio);
    }
  }
  return 0.0;
}

}  // namespace unflex::verify
