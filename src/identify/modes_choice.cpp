#include "modes_choice.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "modes_interval.hpp"
#include "unflex/core/math.hpp"

namespace unflex::identify {
namespace {

constexpr std::string_view kTooDamped = "its damping grows without bound";

// How far a mode with at least this damping swings the nozzle, up to a factor.
double swing_of(const ModeOfAxis& mode, double least_damping = 0.0) {
  return std::abs(mode.gain) / (std::max(mode.damping_ratio, least_damping) * mode.freq_hz);
}

// Order of the modes by their swing, those in the band first.
std::vector<Eigen::Index> by_swing(const std::vector<ModeOfAxis>& modes, const Band& band) {
  std::vector<Eigen::Index> order(modes.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    order[i] = static_cast<Eigen::Index>(i);
  }
  const double top_hz = band.top_hz();
  std::ranges::stable_sort(order, std::ranges::greater{}, [&](Eigen::Index i) {
    const ModeOfAxis& mode = modes[static_cast<std::size_t>(i)];
    return std::pair(mode.freq_hz <= top_hz, swing_of(mode));
  });
  return order;
}

// Main mode first.
Eigen::VectorXd in_order(const Eigen::VectorXd& theta, const Band& band) {
  Eigen::VectorXd result = theta;
  Eigen::Index to = 0;
  for (const Eigen::Index from : by_swing(modes_of(theta), band)) {
    result.segment(3 * to++, 3) = theta.segment(3 * from, 3);
  }
  return result;
}

// Σ|g|, which is 1 where all modes move the same way.
double all_gains(const Eigen::VectorXd& theta) {
  double all = 0.0;
  for (const ModeOfAxis& mode : modes_of(theta)) {
    all += std::abs(mode.gain);
  }
  return all;
}

// Why a solution is not to be trusted; empty if it is.
std::string doubt(const Eigen::VectorXd& theta, const Band& band, const ModesModel& model) {
  constexpr double kMostGain = 2.9;
  constexpr double kLeastGain = -1.9;
  constexpr double kMostOfAllGains = 3.0;
  constexpr double kNoiseEnds = 1.35;  // of the band's start
  constexpr double kNear = 1.03;
  constexpr double kMostDampingOfMain = 0.3;
  constexpr double kLeastOfPair = 0.25;
  constexpr double kApart = 0.15;
  const std::vector<ModeOfAxis> modes = modes_of(theta);
  for (const ModeOfAxis& mode : modes) {
    for (const ModeOfAxis& other : modes) {
      // Two modes at one place that work against each other stand for a shape that is neither's.
      if (mode.gain > kLeastOfPair && other.gain < -kLeastOfPair &&
          std::abs(math::log(mode.freq_hz / other.freq_hz)) < kApart) {
        return "its gains nearly cancel";
      }
    }
    if (!(mode.gain < kMostGain && mode.gain > kLeastGain)) {
      return "its gains nearly cancel";
    }
    if (mode.freq_hz < kNoiseEnds * band.freq_hz[0]) {
      return "what it takes for a resonance may be the noise at low frequencies";
    }
    if (mode.damping_ratio > kMostDamping / kNear) {
      return std::string(kTooDamped);
    }
    if (mode.damping_ratio < kLeastDamping * kNear && &mode == &modes.front()) {
      return "its damping vanishes";
    }
  }
  if (modes.front().damping_ratio > kMostDampingOfMain) {
    return std::string(kTooDamped);
  }
  if (all_gains(theta) > kMostOfAllGains) {
    return "its gains nearly cancel";
  }
  // Little is known of the damping beyond the sweep.
  constexpr double kDampingBeyond = 0.05;
  for (const ModeOfAxis& mode : modes) {
    if (mode.freq_hz > band.top_hz() && swing_of(mode, kDampingBeyond) >= swing_of(modes.front())) {
      return "its resonance lies at the edge of the sweep or beyond";
    }
  }
  Eigen::Index at = 0;
  (band.freq_hz - modes.front().freq_hz).abs().minCoeff(&at);
  if (model.mode_density(theta, 0)[at] < 2.0 * model.noise_density(theta)[at]) {
    return "its resonance does not stand out of the noise";
  }
  return {};
}

// In the lowest mode of a chain of masses all move the same way, as they do at rest.
bool lowest_is_positive(const Eigen::VectorXd& theta) {
  const std::vector<ModeOfAxis> modes = modes_of(theta);
  return std::ranges::min(modes, {}, &ModeOfAxis::freq_hz).gain > 0.0;
}

bool has_mode_near(const Eigen::VectorXd& theta, double freq_log) {
  constexpr double kNear = 0.05;
  for (Eigen::Index m = 0; m < modes_in(theta); ++m) {
    if (std::abs(theta[3 * m] - freq_log) < kNear) {
      return true;
    }
  }
  return false;
}

// The differences of another fit's (log f, log ζ, g): each mode of the best against its nearest.
Eigen::VectorXd difference(const std::vector<ModeOfAxis>& best,
                           const std::vector<ModeOfAxis>& other) {
  constexpr double kFarthest = 0.15;
  Eigen::VectorXd result = Eigen::VectorXd::Zero(3 * static_cast<Eigen::Index>(best.size()));
  for (std::size_t m = 0; m < best.size(); ++m) {
    const auto distance = [&](const ModeOfAxis& mode) {
      return std::abs(math::log(mode.freq_hz / best[m].freq_hz));
    };
    const ModeOfAxis nearest = std::ranges::min(other, {}, distance);
    if (distance(nearest) < kFarthest) {
      result.segment(3 * static_cast<Eigen::Index>(m), 3)
          << math::log(nearest.freq_hz / best[m].freq_hz),
          math::log(nearest.damping_ratio / best[m].damping_ratio), nearest.gain - best[m].gain;
    }
  }
  return result;
}

// Takes a solution that is `worse` by the criterion as a rival, if it is nearly as good as the best
// and its response differs from all rivals before. A machine may well be damped more than a trusted
// fit allows.
void add_rival(const Solution& solution, double worse, const Band& band, const ModesModel& model,
               Choice& choice) {
  constexpr double kNearlyEqual = 6.0;
  constexpr double kAsGood = 2.0;
  constexpr double kOther = 0.07;
  const Eigen::VectorXd theta = in_order(solution.fit.parameters, band);
  const std::string reason = doubt(theta, band, model);
  if (worse > kNearlyEqual || (!reason.empty() && reason != kTooDamped)) {
    return;
  }
  const std::vector<ModeOfAxis> modes = modes_of(theta);
  const std::vector<ModeOfAxis> best = modes_of(choice.theta);
  const double far = kOther * swing(best);
  const bool is_known =
      distance(modes, best) < far || std::ranges::any_of(choice.rivals, [&](const Rival& rival) {
        return distance(modes, modes_of(rival.theta)) < far;
      });
  if (!is_known) {
    choice.rivals.push_back(
        {theta, math::exp(-0.5 * std::max(worse, 0.0)),
         reason.empty() && worse < kAsGood &&
             (!has_mode_near(choice.theta, theta[0]) || !has_mode_near(theta, choice.theta[0]))});
  }
}

}  // namespace

bool has_other_main(const Choice& choice) {
  return std::ranges::any_of(choice.rivals, &Rival::has_other_main);
}

Choice choose(const std::vector<std::vector<Solution>>& found, const Band& band,
              const ModesModel& model) {
  constexpr double kPhaseWorth = 4.0;  // of the criterion
  constexpr double kSignWorth = 6.0;
  constexpr double kRiseWorth = 3.0;
  constexpr double kGainWorth = 5.0;
  const auto merit = [](const Solution& s) {
    return s.bic + (s.is_minimum_phase ? 0.0 : kPhaseWorth) +
           (lowest_is_positive(s.fit.parameters) ? 0.0 : kSignWorth) +
           (rises(s.fit.parameters) ? kRiseWorth : 0.0) +
           kGainWorth * (all_gains(s.fit.parameters) - 1.0);
  };
  std::vector<const Solution*> all;
  for (const std::vector<Solution>& some : found) {
    for (const Solution& solution : some) {
      all.push_back(&solution);
    }
  }
  std::ranges::stable_sort(all, {}, [&](const Solution* s) { return merit(*s); });
  Choice choice;
  double odds = 1.0;
  choice.theta = in_order(all.front()->fit.parameters, band);
  choice.spread = Eigen::MatrixXd::Zero(choice.theta.size() - 2, choice.theta.size() - 2);
  for (const Solution* solution : all) {
    const Eigen::VectorXd theta = in_order(solution->fit.parameters, band);
    const std::string reason = doubt(theta, band, model);
    if (!reason.empty()) {
      if (choice.best == nullptr && choice.doubt.empty()) {
        choice.doubt = reason;
      }
    } else if (choice.best == nullptr) {
      choice.best = solution;
      choice.closer_by = merit(*solution) - merit(*all.front());
      choice.theta = theta;
      choice.spread = Eigen::MatrixXd::Zero(theta.size() - 2, theta.size() - 2);
    } else {
      const double odd = math::exp(-0.5 * (merit(*solution) - merit(*choice.best)));
      const Eigen::VectorXd off = difference(modes_of(choice.theta), modes_of(theta));
      choice.spread += odd * off * off.transpose();
      odds += odd;
    }
  }
  choice.spread /= odds;
  for (const Solution* solution : all) {
    if (choice.best != nullptr && solution != choice.best) {
      add_rival(*solution, merit(*solution) - merit(*choice.best), band, model, choice);
    }
  }
  return choice;
}

}  // namespace unflex::identify
