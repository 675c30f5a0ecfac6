// How many moves a file asks of the firmware per second.
#pragma once

#include <algorithm>
#include <cstddef>
#include <deque>

namespace unflex::verify {

class MoveRate {
 public:
  // A move begins at time start_s; times do not decrease.
  void add(double start_s) {
    starts_s_.push_back(start_s);
    while (starts_s_.front() <= start_s - kSpan_s) {
      starts_s_.pop_front();
    }
    most_ = std::max(most_, starts_s_.size());
  }
  // Most moves begun within any 100 ms, per second.
  [[nodiscard]] double max_per_s() const { return static_cast<double>(most_) / kSpan_s; }

 private:
  static constexpr double kSpan_s = 0.1;
  std::deque<double> starts_s_;
  std::size_t most_ = 0;
};

}  // namespace unflex::verify
