// The results of the rounds of a section's search, and the limits of the next round.
#pragma once

#include <cstddef>
#include <vector>

#include "excess.hpp"

namespace unflex::timing {

class SectionRounds {
 public:
  // is_band: the axes may be a little off.
  SectionRounds(std::size_t periods, bool is_band);

  // Takes the result of a round: the largest values of each period, and the excess at the end,
  // where the base and its clock are given. There the nozzles at the edges of a band stray, and
  // they swing after it.
  void show(std::vector<Excess> of_periods, double of_end);
  // The largest of all periods, as shown.
  [[nodiscard]] const Excess& worst() const { return worst_; }
  [[nodiscard]] bool is_kept() const;
  // Whether no round has come close to the limits yet, or the last round has gone far from them.
  [[nodiscard]] bool is_far() const;
  // Whether the excess has not changed since the round before, so that it does not come right any
  // more. The first round is round 0.
  [[nodiscard]] bool is_stuck(int round) const;

  // Fits trust and factors to the result. surprise: how far each period's values are from those
  // that the program had foreseen, relative to the limits.
  void adapt(const std::vector<double>& surprise, int round);

  // The share by which T′ may change at a node, and the share by which it may grow.
  [[nodiscard]] double trust(std::size_t node) const { return trust_[node]; }
  [[nodiscard]] double trust_to_slow(std::size_t node) const;
  // The aims of a period's rows, as factors of the limits.
  [[nodiscard]] Excess factors(std::size_t period) const;

 private:
  std::vector<double> trust_;  // at the nodes
  double largest_trust_;
  std::vector<Excess> factors_;  // per period
  std::vector<Excess> excess_;   // per period, as shown
  std::vector<double> broken_;   // largest excess of each period
  Excess worst_;
  double last_broken_ = 0.0;  // the largest of all, a round before
  double end_excess_ = 0.0;
  double end_factor_ = 1.0;  // of the base's acceleration before the end
};

}  // namespace unflex::timing
