#include "modes_search.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "unflex/core/math.hpp"

namespace unflex::identify {
namespace {

constexpr int kStepsOfScreening = 7;
constexpr int kStepsOfFit = 60;
constexpr std::size_t kRefined = 8;   // starts that are followed to the end
constexpr std::size_t kExtended = 4;  // solutions that get another mode
constexpr double kFirstNoise = 1e-3;

double bic_of(const ModesModel& model, const RobustFit& fit, Eigen::Index unknowns) {
  const double bins = model.independent_bins();
  return bins * math::log(fit.loss / static_cast<double>(fit.residual.size())) +
         static_cast<double>(unknowns) * math::log(bins);
}

Eigen::VectorXd with_mode(const Eigen::VectorXd& theta, double freq_hz, double damping_ratio,
                          double a) {
  const Eigen::Index count = theta.size() - 2;
  Eigen::VectorXd result(theta.size() + 3);
  result << theta.head(count), math::log(freq_hz), math::log(damping_ratio), a, theta.tail(2);
  return result;
}

double sum_of_a(const Eigen::VectorXd& theta) {
  double sum = 0.0;
  for (Eigen::Index m = 0; m < modes_in(theta); ++m) {
    sum += theta[3 * m + 2];
  }
  return sum;
}

// Frequencies of the local maxima of the density, highest first.
std::vector<double> peaks_of(const Eigen::ArrayXd& freq_hz, const Eigen::ArrayXd& density,
                             std::size_t most) {
  std::vector<std::pair<double, double>> peaks;
  for (Eigen::Index i = 1; i + 1 < density.size(); ++i) {
    if (density[i] >= density[i - 1] && density[i] > density[i + 1]) {
      peaks.emplace_back(density[i], freq_hz[i]);
    }
  }
  std::ranges::sort(peaks, std::ranges::greater{});
  std::vector<double> result;
  for (std::size_t i = 0; i < std::min(most, peaks.size()); ++i) {
    result.push_back(peaks[i].second);
  }
  return result;
}

// Places for another mode: peaks of the density, of the swing, and of what the fit leaves, and an
// even spread.
std::vector<double> places_for_mode(const Band& band, const Solution* base) {
  std::vector<double> places;
  const auto add = [&](const std::vector<double>& more) {
    for (const double freq_hz : more) {
      const bool is_new = std::ranges::none_of(places, [&](double other_hz) {
        return std::abs(other_hz - freq_hz) < 2.0 * band.step_hz;
      });
      if (is_new) {
        places.push_back(freq_hz);
      }
    }
  };
  if (base != nullptr) {
    const Eigen::ArrayXd& left = base->fit.residual;
    Eigen::ArrayXd smooth = left;
    for (Eigen::Index i = 1; i + 1 < left.size(); ++i) {
      smooth[i] = (left[i - 1] + left[i] + left[i + 1]) / 3.0;
    }
    add(peaks_of(band.freq_hz, smooth, 3));
    add(peaks_of(band.freq_hz, -smooth, 2));
  }
  add(peaks_of(band.freq_hz, band.density, 3));
  add(peaks_of(band.freq_hz, band.density / band.freq_hz.square(), 3));
  for (const double freq_hz : {25.0, 35.0, 50.0, 70.0, 90.0, 110.0, 135.0}) {
    add({freq_hz});
  }
  return places;
}

// Gains that nearly cancel can draw any shape. So a Σ|g| larger than a machine's counts like a bin
// that is off. The values get a last row for it.
void append_cancelling(const Eigen::VectorXd& theta, Eigen::ArrayXd& values,
                       Eigen::MatrixXd* jacobian) {
  constexpr double kMostOfAllGains = 1.7;
  constexpr double kWeight = 1.0;
  const double sum = sum_of_a(theta);
  double all = 0.0;
  for (Eigen::Index m = 0; m < modes_in(theta); ++m) {
    all += std::abs(theta[3 * m + 2]);
  }
  const double excess = all / std::abs(sum) - kMostOfAllGains;
  const Eigen::Index row = values.size();
  values.conservativeResize(row + 1);
  values[row] = kWeight * std::max(excess, 0.0);
  if (jacobian != nullptr) {
    jacobian->conservativeResize(row + 1, Eigen::NoChange);
    jacobian->row(row).setZero();
    for (Eigen::Index m = 0; excess > 0.0 && m < modes_in(theta); ++m) {
      const double a = theta[3 * m + 2];
      (*jacobian)(row, 3 * m + 2) =
          kWeight * (std::copysign(1.0, a) / std::abs(sum) - all / (sum * std::abs(sum)));
    }
  }
}

bool is_same(const Solution& a, const Solution& b) {
  return std::abs(a.fit.cost - b.fit.cost) < 1e-3 * (a.fit.cost + 1e-3) &&
         a.is_minimum_phase == b.is_minimum_phase;
}

class Search {
 public:
  Search(const Band& band, const ModesModel& model, const Sweep& sweep, bool noise_rises)
      : band_(band),
        model_(model),
        sweep_(sweep),
        noise_rises_(noise_rises),
        logarithms_(band.logarithms()) {}

  std::vector<Solution> first() {
    std::vector<Eigen::VectorXd> starts;
    const Eigen::VectorXd empty = without_modes();
    for (const double freq_hz : places_for_mode(band_, nullptr)) {
      for (const double damping_ratio : {0.05, 0.15}) {
        starts.push_back(scaled(with_mode(empty, freq_hz, damping_ratio, 1.0)));
      }
    }
    return solve(starts);
  }

  std::vector<Solution> next(const std::vector<Solution>& fewer) {
    std::vector<Eigen::VectorXd> starts;
    for (std::size_t i = 0; i < std::min(kExtended, fewer.size()); ++i) {
      const Eigen::VectorXd& base = fewer[i].fit.parameters;
      for (const double freq_hz : places_for_mode(band_, &fewer[i])) {
        for (const double share : {0.15, -0.15}) {
          starts.push_back(with_mode(base, freq_hz, 0.07, share * sum_of_a(base)));
        }
      }
    }
    const Eigen::Index modes = modes_in(fewer.front().fit.parameters) + 1;
    constexpr int kRandomStarts = 12;
    for (int i = 0; i < kRandomStarts; ++i) {
      starts.push_back(random_start(modes));
    }
    return solve(starts);
  }

 private:
  [[nodiscard]] double uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(random_()) / 4294967296.0;
  }

  [[nodiscard]] Eigen::VectorXd without_modes() const {
    return Eigen::Vector2d(math::log(kFirstNoise),
                           noise_rises_ ? math::log(kFirstNoise) : kNoRise_log);
  }

  // Scales all amplitudes so that the logarithm of the density is right on average.
  [[nodiscard]] Eigen::VectorXd scaled(Eigen::VectorXd theta) const {
    Eigen::ArrayXd values;
    model_(theta, values, nullptr);
    const double factor = math::exp(0.5 * (logarithms_ - values).mean());
    for (Eigen::Index m = 0; m < modes_in(theta); ++m) {
      theta[3 * m + 2] *= factor;
    }
    return theta;
  }

  [[nodiscard]] Eigen::VectorXd random_start(Eigen::Index modes) {
    Eigen::VectorXd theta = without_modes();
    for (Eigen::Index m = 0; m < modes; ++m) {
      const double freq_hz = 20.0 * math::pow(6.5, uniform(0.0, 1.0));
      const double damping_ratio = 0.03 * math::pow(8.0, uniform(0.0, 1.0));
      const double a = m == 0 ? 1.0 : uniform(-0.4, 0.8);
      theta = with_mode(theta, freq_hz, damping_ratio, a);
    }
    return scaled(theta);
  }

  [[nodiscard]] Solution fitted(const Eigen::VectorXd& start, int steps) const {
    const ModelWithJacobian call = [this](const Eigen::VectorXd& theta, Eigen::ArrayXd& values,
                                          Eigen::MatrixXd* jacobian) {
      model_(theta, values, jacobian);
      append_cancelling(theta, values, jacobian);
    };
    const Eigen::Index bins = logarithms_.size();
    Eigen::ArrayXd data(bins + 1);
    data << logarithms_, 0.0;
    Solution solution;
    RobustFit& fit = solution.fit;
    fit = minimise_robust(call, data, kLossScale, prior_of(start, sweep_), start, steps);
    fit.residual.conservativeResize(bins);
    fit.weights.conservativeResize(bins);
    fit.jacobian.conservativeResize(bins, Eigen::NoChange);
    fit.loss = soft_loss(fit.residual, kLossScale);
    return solution;
  }

  void finish(Solution& solution) const {
    const Eigen::VectorXd& theta = solution.fit.parameters;
    solution.bic = bic_of(model_, solution.fit, theta.size() - (rises(theta) ? 0 : 1));
    solution.is_minimum_phase = is_minimum_phase(modes_of(theta));
  }

  // All starts for a few steps, and the best of them to the end. Those with a zero in the right
  // half plane are tried mirrored, too.
  [[nodiscard]] std::vector<Solution> solve(const std::vector<Eigen::VectorXd>& starts) const {
    std::vector<Solution> screened;
    for (const Eigen::VectorXd& start : starts) {
      screened.push_back(fitted(start, kStepsOfScreening));
    }
    const auto by_cost = [](const Solution& s) { return s.fit.cost; };
    std::ranges::stable_sort(screened, {}, by_cost);
    std::vector<Solution> solutions;
    const auto keep = [&](Solution solution) {
      finish(solution);
      if (std::ranges::none_of(solutions,
                               [&](const Solution& s) { return is_same(s, solution); })) {
        solutions.push_back(std::move(solution));
      }
    };
    double last_cost = -1.0;
    std::size_t followed = 0;
    for (const Solution& start : screened) {
      const bool is_new = start.fit.cost - last_cost > 1e-3 * start.fit.cost;
      if (!is_new || followed == kRefined) {
        continue;
      }
      last_cost = start.fit.cost;
      ++followed;
      keep(fitted(start.fit.parameters, kStepsOfFit));
      if (!solutions.back().is_minimum_phase) {
        keep(fitted(mirrored(solutions.back().fit.parameters, band_.freq_hz), kStepsOfFit));
      }
    }
    std::ranges::stable_sort(solutions, {}, by_cost);
    return solutions;
  }

  const Band& band_;
  const ModesModel& model_;
  const Sweep& sweep_;
  bool noise_rises_;
  Eigen::ArrayXd logarithms_;
  std::mt19937 random_{1};
};

}  // namespace

// The knowledge before the fit: damping ratios are about 0.08 within a factor of 2.2, amplitudes
// are of the order of 1, and noise is somewhere below the motion. The knowledge is weak: it holds
// only what the record leaves open. Precisions are for a scatter of 0.2 of the logarithm.
Prior prior_of(const Eigen::VectorXd& theta, const Sweep& sweep) {
  constexpr double kVariance = 0.04;
  const Eigen::Index modes = modes_in(theta);
  const Eigen::Index count = theta.size();
  Prior prior{.low = Eigen::VectorXd(count),
              .high = Eigen::VectorXd(count),
              .centre = Eigen::VectorXd(count),
              .precision = Eigen::VectorXd(count)};
  const auto set = [&](Eigen::Index i, double low, double high, double centre, double deviation) {
    prior.low[i] = low;
    prior.high[i] = high;
    prior.centre[i] = centre;
    prior.precision[i] = kVariance / (deviation * deviation);
  };
  for (Eigen::Index m = 0; m < modes; ++m) {
    set(3 * m, math::log(std::max(0.9 * kFitFrom_hz, sweep.start_hz)),
        math::log(1.25 * sweep.end_hz), math::log(60.0), 1.5);
    set(3 * m + 1, math::log(kLeastDamping), math::log(kMostDamping), math::log(0.08), 0.8);
    set(3 * m + 2, -30.0, 30.0, 0.0, 2.0);
  }
  for (Eigen::Index i = 3 * modes; i < count; ++i) {
    set(i, math::log(1e-8), math::log(10.0), math::log(1e-3), 3.0);
  }
  if (!rises(theta)) {
    prior.low[count - 1] = prior.high[count - 1] = prior.centre[count - 1] = kNoRise_log;
  }
  return prior;
}

Solution rigid(const ModesModel& model, const Eigen::ArrayXd& logarithms) {
  constexpr double kFarAbove_hz = 1e5;
  constexpr Eigen::Index kUnknowns = 3;
  Prior prior = prior_of(Eigen::VectorXd::Zero(5), Sweep{});
  prior.low[0] = prior.high[0] = prior.centre[0] = math::log(kFarAbove_hz);
  prior.low[1] = prior.high[1] = prior.centre[1];
  Solution best;
  for (const double a : {1.0, 0.1}) {
    Eigen::VectorXd start = prior.centre;
    start[2] = a;
    const ModelWithJacobian call = [&](const Eigen::VectorXd& theta, Eigen::ArrayXd& values,
                                       Eigen::MatrixXd* jacobian) {
      model(theta, values, jacobian);
    };
    RobustFit fit = minimise_robust(call, logarithms, kLossScale, prior, start, kStepsOfFit);
    if (best.fit.parameters.size() == 0 || fit.cost < best.fit.cost) {
      best.fit = std::move(fit);
    }
  }
  best.bic = bic_of(model, best.fit, kUnknowns);
  return best;
}

std::vector<std::vector<Solution>> search(const Band& band, const ModesModel& model,
                                          const Sweep& sweep, Eigen::Index most) {
  std::vector<std::vector<Solution>> found(static_cast<std::size_t>(most));
  for (const bool noise_rises : {false, true}) {
    Search search(band, model, sweep, noise_rises);
    std::vector<Solution> some;
    for (std::vector<Solution>& all : found) {
      some = some.empty() ? search.first() : search.next(some);
      if (some.empty()) {
        break;
      }
      all.insert(all.end(), some.begin(), some.end());
    }
  }
  std::erase_if(found, [](const std::vector<Solution>& all) { return all.empty(); });
  return found;
}

}  // namespace unflex::identify
