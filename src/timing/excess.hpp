// A motion's values relative to its three limits.
#pragma once

#include <algorithm>

namespace unflex::timing {

// Values relative to their limits, or factors of the limits.
struct Excess {
  double accel = 0.0;
  double error = 0.0;
  double feed = 0.0;

  void include(const Excess& other) {
    accel = std::max(accel, other.accel);
    error = std::max(error, other.error);
    feed = std::max(feed, other.feed);
  }
  [[nodiscard]] bool is_within(const Excess& limits) const {
    return accel <= limits.accel && error <= limits.error && feed <= limits.feed;
  }
  [[nodiscard]] double largest() const { return std::max({accel, error, feed}); }
};

}  // namespace unflex::timing
