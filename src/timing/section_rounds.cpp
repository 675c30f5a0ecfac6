#include "section_rounds.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tunings.hpp"

namespace unflex::timing {
namespace {

using Tuned = OptimalTunings;

// The largest value around a node.
double largest_near(std::size_t node, const std::vector<double>& of_periods) {
  double largest = 0.0;
  const std::size_t end = std::min(node + Tuned::kReach + 1, of_periods.size());
  for (std::size_t k = node > Tuned::kReach ? node - Tuned::kReach : 0; k < end; ++k) {
    largest = std::max(largest, of_periods[k]);
  }
  return largest;
}

void tighten(double& factor, double excess, double allowed, double tightest) {
  if (excess > allowed && excess < Tuned::kMostTightening) {
    factor = std::max(factor / excess, tightest);
  }
}

}  // namespace

SectionRounds::SectionRounds(std::size_t periods, bool is_band)
    : trust_(periods + 1, is_band ? Tuned::kFirstTrustOfBand : Tuned::kFirstTrust),
      largest_trust_(trust_.front()),
      factors_(periods, Tuned::kAim) {}

void SectionRounds::show(std::vector<Excess> of_periods, double of_end) {
  last_broken_ = worst_.largest();
  excess_ = std::move(of_periods);
  end_excess_ = of_end;
  worst_ = {};
  broken_.clear();
  for (const Excess& excess : excess_) {
    worst_.include(excess);
    broken_.push_back(excess.largest());
  }
}

bool SectionRounds::is_kept() const {
  return worst_.is_within(Tuned::kKept) && end_excess_ <= Tuned::kKept.error;
}

bool SectionRounds::is_far() const {
  return broken_.empty() || worst_.largest() > Tuned::kMostTightening;
}

bool SectionRounds::is_stuck(int round) const {
  const double broken = worst_.largest();
  return round >= Tuned::kRoundsToSettle && broken > Tuned::kMostTightening &&
         std::abs(broken - last_broken_) < Tuned::kStuck * broken;
}

double SectionRounds::trust_to_slow(std::size_t node) const {
  // The last node belongs to the last period.
  return largest_near(std::min(node, factors_.size() - 1), broken_) > Tuned::kBroken
             ? std::max(trust_[node], Tuned::kTrustToSlow)
             : trust_[node];
}

Excess SectionRounds::factors(std::size_t period) const {
  Excess factors = factors_[period];
  if (period + Tuned::kNodesBeforeEnd >= factors_.size()) {
    factors.accel *= end_factor_;
  }
  return factors;
}

void SectionRounds::adapt(const std::vector<double>& surprise, int round) {
  const std::size_t periods = factors_.size();
  largest_trust_ *= Tuned::kCooling;
  for (std::size_t k = 0; k <= periods; ++k) {
    const double factor = std::clamp(std::sqrt(Tuned::kSurprise / largest_near(k, surprise)),
                                     Tuned::kShrink, Tuned::kGrow);
    trust_[k] = std::clamp(trust_[k] * factor, Tuned::kLeastTrust, largest_trust_);
  }
  for (std::size_t k = 0; round >= Tuned::kFirstRoughRounds && k < periods; ++k) {
    Excess near = excess_[k];
    near.include(excess_[k > 0 ? k - 1 : 0]);
    near.include(excess_[std::min(k + 1, periods - 1)]);
    tighten(factors_[k].accel, near.accel, Tuned::kTightenAbove.accel, Tuned::kTightest.accel);
    tighten(factors_[k].error, near.error, Tuned::kTightenAbove.error, Tuned::kTightest.error);
    tighten(factors_[k].feed, near.feed, Tuned::kTightenAbove.feed, Tuned::kTightest.feed);
  }
  if (end_excess_ > 1.0 || end_factor_ < 1.0) {
    const double times = std::clamp(1.0 / std::sqrt(end_excess_), Tuned::kTighter, Tuned::kLooser);
    end_factor_ = std::clamp(end_factor_ * times, Tuned::kTightestBeforeEnd, 1.0);
  }
}

}  // namespace unflex::timing
