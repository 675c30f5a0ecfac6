// What the rounds of a section's search have shown, and what the next one may do.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace unflex::timing {

// Values relative to what is allowed, or factors of what is allowed.
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

class SectionRounds {
 public:
  // is_band: the axes may be a little off.
  SectionRounds(std::size_t periods, bool is_band);

  // What a round has come to: the largest values of each period, and of the end, where the base and
  // its clock are given (how far nozzles at the edges of a band stray there and swing after it).
  void show(std::vector<Excess> of_periods, double of_end);
  // The largest of all periods, as shown.
  [[nodiscard]] const Excess& worst() const { return worst_; }
  [[nodiscard]] bool is_kept() const;
  // Whether no round has come close to what is allowed yet, or the last one has gone far from it.
  [[nodiscard]] bool is_far() const;
  // Whether as much is broken as a round ago, so that it does not come right any more. Counts
  // rounds from 0.
  [[nodiscard]] bool is_stuck(int round) const;

  // Fits trust and factors to what was shown. surprise: how far each period's values are from what
  // the program had foreseen, relative to what is allowed.
  void adapt(const std::vector<double>& surprise, int round);

  // What T′ may change by at a node, relative to itself, and by how much it may grow.
  [[nodiscard]] double trust(std::size_t node) const { return trust_[node]; }
  [[nodiscard]] double trust_to_slow(std::size_t node) const;
  // What rows of a period aim at, as factors of what is allowed.
  [[nodiscard]] Excess factors(std::size_t period) const;

 private:
  std::vector<double> trust_;  // at the nodes
  double largest_trust_;
  std::vector<Excess> factors_;  // per period
  std::vector<Excess> excess_;   // likewise, as shown
  std::vector<double> broken_;   // largest excess of each period
  Excess worst_;
  double last_broken_ = 0.0;  // the largest of all, a round before
  double end_excess_ = 0.0;
  double end_factor_ = 1.0;  // of the base's acceleration before the end
};

}  // namespace unflex::timing
