#include "unflex/verify/log_histogram.hpp"

#include <cmath>
#include <numeric>

namespace unflex::verify {

double LogHistogram::border(std::size_t cell) {
  return std::sqrt(std::bit_cast<double>((kFirst + cell) << kDropped));
}

double LogHistogram::quantile(double fraction) const {
  const double target = fraction * std::accumulate(weights_.begin(), weights_.end(), 0.0);
  double weight = 0.0;
  for (std::size_t cell = 0; cell < weights_.size(); ++cell) {
    const double here = weights_[cell];
    if (here > 0.0 && weight + here >= target) {
      const double share = (target - weight) / here;
      return border(cell) + share * (border(cell + 1) - border(cell));
    }
    weight += here;
  }
  return 0.0;
}

double LogHistogram::weight_below(double value) const {
  double weight = 0.0;
  for (std::size_t cell = 0; cell < weights_.size() && border(cell) < value; ++cell) {
    weight += weights_[cell];
  }
  return weight;
}

}  // namespace unflex::verify
