#include "section_rounds.hpp"

#include <cmath>
#include <utility>

namespace unflex::timing {
namespace {

// What T′ may change by in a round: at first, and at least. The program does not foresee the second
// order, which goes with the square of a step. The next step is made so long that this surprise is
// that share of what is allowed.
constexpr double kFirstTrust = 0.3;
constexpr double kFirstTrustOfBand = 0.12;
constexpr double kLeastTrust = 1e-3;
constexpr double kSurprise = 0.15;
constexpr double kShrink = 0.25;
constexpr double kGrow = 1.6;
constexpr double kCooling = 0.85;
constexpr std::size_t kReach = 8;  // nodes
// Where more is broken, T′ may grow by this at least, as slower motion breaks less.
constexpr double kBroken = 1.1;
constexpr double kTrustToSlow = 0.1;

constexpr Excess kAim{0.985, 1.0, 1.0};
// Largest excess that still counts as kept; excess above which rows are tightened; how far they are
// tightened at most.
constexpr Excess kKept{1.025, 1.03, 1.015};
constexpr Excess kTightenAbove{1.01, 1.0, 1.013};
constexpr Excess kTightest{0.8, 0.6, 0.95};
// Rows that are broken by more are not tightened, since the reason is elsewhere. If after some
// rounds they are broken as much as a round ago, but for this share, the search is stuck.
constexpr double kMostTightening = 1.3;
constexpr double kStuck = 0.01;
constexpr int kRoundsToSettle = 4;
constexpr int kFirstRoughRounds = 2;
// How the nozzles at the edges of a band swing in the end cannot be chosen there. Less acceleration
// over these nodes makes less of it.
constexpr std::size_t kNodesBeforeEnd = 80;
constexpr double kTightestBeforeEnd = 0.25;
constexpr double kTighter = 0.5;
constexpr double kLooser = 1.1;

// The largest value around a node.
double largest_near(std::size_t node, const std::vector<double>& of_periods) {
  double largest = 0.0;
  const std::size_t end = std::min(node + kReach + 1, of_periods.size());
  for (std::size_t k = node > kReach ? node - kReach : 0; k < end; ++k) {
    largest = std::max(largest, of_periods[k]);
  }
  return largest;
}

void tighten(double& factor, double excess, double allowed, double tightest) {
  if (excess > allowed && excess < kMostTightening) {
    factor = std::max(factor / excess, tightest);
  }
}

}  // namespace

SectionRounds::SectionRounds(std::size_t periods, bool is_band)
    : trust_(periods + 1, is_band ? kFirstTrustOfBand : kFirstTrust),
      largest_trust_(trust_.front()),
      factors_(periods, kAim) {}

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
  return worst_.is_within(kKept) && end_excess_ <= kKept.error;
}

bool SectionRounds::is_far() const { return broken_.empty() || worst_.largest() > kMostTightening; }

bool SectionRounds::is_stuck(int round) const {
  const double broken = worst_.largest();
  return round >= kRoundsToSettle && broken > kMostTightening &&
         std::abs(broken - last_broken_) < kStuck * broken;
}

double SectionRounds::trust_to_slow(std::size_t node) const {
  // The last node belongs to the last period.
  return largest_near(std::min(node, factors_.size() - 1), broken_) > kBroken
             ? std::max(trust_[node], kTrustToSlow)
             : trust_[node];
}

Excess SectionRounds::factors(std::size_t period) const {
  Excess factors = factors_[period];
  if (period + kNodesBeforeEnd >= factors_.size()) {
    factors.accel *= end_factor_;
  }
  return factors;
}

void SectionRounds::adapt(const std::vector<double>& surprise, int round) {
  const std::size_t periods = factors_.size();
  largest_trust_ *= kCooling;
  for (std::size_t k = 0; k <= periods; ++k) {
    const double factor =
        std::clamp(std::sqrt(kSurprise / largest_near(k, surprise)), kShrink, kGrow);
    trust_[k] = std::clamp(trust_[k] * factor, kLeastTrust, largest_trust_);
  }
  for (std::size_t k = 0; round >= kFirstRoughRounds && k < periods; ++k) {
    Excess near = excess_[k];
    near.include(excess_[k > 0 ? k - 1 : 0]);
    near.include(excess_[std::min(k + 1, periods - 1)]);
    tighten(factors_[k].accel, near.accel, kTightenAbove.accel, kTightest.accel);
    tighten(factors_[k].error, near.error, kTightenAbove.error, kTightest.error);
    tighten(factors_[k].feed, near.feed, kTightenAbove.feed, kTightest.feed);
  }
  if (end_excess_ > 1.0 || end_factor_ < 1.0) {
    const double times = std::clamp(1.0 / std::sqrt(end_excess_), kTighter, kLooser);
    end_factor_ = std::clamp(end_factor_ * times, kTightestBeforeEnd, 1.0);
  }
}

}  // namespace unflex::timing
