// Variable projection (Golub and Pereyra, The differentiation of pseudo-inverses and nonlinear
// least squares problems whose variables separate, SIAM J. Numer. Anal. 1973): for given τ₁, τ₂, θ
// the model
//
//   T(t) = K a(t) + T₁(0) b(t) + T(0) c(t) + T_amb
//
// is linear in the rest, so that only the three are searched:
//
//   p = (ln τ₁, ln τ₂, θ / s),   r(p) = y − C(p) C(p)⁺ y
//
// on a grid first, and from its best places on by Levenberg's and Marquardt's method with
// differences for the derivatives of r.
#include "unflex/hotend/fit.hpp"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "fit_errors.hpp"
#include "fit_model.hpp"
#include "jumps.hpp"
#include "unflex/core/levenberg_marquardt.hpp"
#include "unflex/core/math.hpp"

namespace unflex::hotend {
namespace {

constexpr double kShortestLag_s = 0.05;

struct Solution {
  Eigen::Vector3d p;
  Eigen::VectorXd linear;
  Eigen::VectorXd residual;
  double sum = 0.0;  // of the residual's squares
};

Eigen::Vector3d within_bounds(Eigen::Vector3d p) {
  constexpr double kLongestConstant_s = 5000.0;
  constexpr double kLongestLag_s = 100.0;
  constexpr double kLongestDeadTime_s = 60.0;
  p[0] = std::clamp(p[0], math::log(2.0), math::log(kLongestConstant_s));
  p[1] = std::clamp(p[1], math::log(kShortestLag_s), std::min(p[0], math::log(kLongestLag_s)));
  p[2] = std::clamp(p[2], 0.0, kLongestDeadTime_s);
  return p;
}

Lags lags_of(const Eigen::Vector3d& p) { return {math::exp(p[0]), math::exp(p[1]), p[2]}; }

class Search {
 public:
  Search(const Log& log, const FitModel& model, Eigen::VectorXd data, Beginning beginning,
         bool with_ambient)
      : log_(log),
        model_(model),
        data_(std::move(data)),
        beginning_(beginning),
        with_ambient_(with_ambient) {}

  // Columns of the linear unknowns; those of the jumps come last. Below the data's rows there is
  // one row for each jump.
  [[nodiscard]] Eigen::MatrixXd columns(const Eigen::Vector3d& p) const {
    const Eigen::MatrixXd plain = model_.columns(lags_of(p), beginning_, with_ambient_);
    if (jumps_.empty()) {
      return plain;
    }
    const Eigen::Index count = weights_.size();
    Eigen::MatrixXd all = Eigen::MatrixXd::Zero(plain.rows() + count, plain.cols() + count);
    all.topLeftCorner(plain.rows(), plain.cols()) = plain;
    all.topRightCorner(plain.rows(), count) = columns_of(jumps_, log_, lags_of(p));
    all.bottomRightCorner(count, count) = weights_.asDiagonal();
    return all;
  }

  // The number of linear unknowns besides the jumps.
  [[nodiscard]] Eigen::Index plain_unknowns() const {
    return 1 + (beginning_.at_rest ? 0 : 2) + (with_ambient_ ? 1 : 0);
  }

  [[nodiscard]] Solution at(const Eigen::Vector3d& p) const {
    const Eigen::MatrixXd matrix = columns(p);
    Solution solution;
    solution.p = p;
    solution.linear = matrix.colPivHouseholderQr().solve(data_);
    solution.residual = data_ - matrix * solution.linear;
    solution.sum = solution.residual.squaredNorm();
    return solution;
  }

  [[nodiscard]] Solution best() {
    Solution solution = best_of_grid();
    jumps_ = jumps_of(log_);
    if (jumps_.empty() || solution.linear[0] <= 0.0) {
      jumps_.clear();
      return solution;
    }
    const double noise_c = std::sqrt(solution.sum / static_cast<double>(data_.size()));
    weights_.resize(static_cast<Eigen::Index>(jumps_.size()));
    for (std::size_t j = 0; j < jumps_.size(); ++j) {
      weights_[static_cast<Eigen::Index>(j)] =
          noise_c * std::sqrt(12.0) / (solution.linear[0] * std::abs(jumps_[j].power));
    }
    data_.conservativeResizeLike(Eigen::VectorXd::Zero(data_.size() + weights_.size()));
    solution = at(solution.p);
    refine(solution);
    return solution;
  }

  [[nodiscard]] Solution best_of_grid() const {
    std::vector<Solution> found = grid();
    constexpr std::size_t kTried = 3;
    const auto by_sum = [](const Solution& s) { return s.sum; };
    std::ranges::partial_sort(found, found.begin() + kTried, {}, by_sum);
    found.resize(kTried);
    for (Solution& solution : found) {
      refine(solution);
    }
    return std::move(*std::ranges::min_element(found, {}, by_sum));
  }

  // Derivatives by p with the linear unknowns held, then derivatives by the linear unknowns.
  [[nodiscard]] Eigen::MatrixXd jacobian(const Solution& solution) const {
    const Eigen::MatrixXd matrix = columns(solution.p);
    Eigen::MatrixXd all(matrix.rows(), 3 + matrix.cols());
    for (Eigen::Index j = 0; j < 3; ++j) {
      const auto [low, high] = around(solution.p, j);
      all.col(j) = (columns(high) - columns(low)) * solution.linear / (high[j] - low[j]);
    }
    all.rightCols(matrix.cols()) = matrix;
    return all;
  }

 private:
  struct Pair {
    Eigen::Vector3d low;
    Eigen::Vector3d high;
  };

  static Pair around(const Eigen::Vector3d& p, Eigen::Index j) {
    constexpr double kStep = 1e-3;
    Pair pair{p, p};
    pair.low[j] -= kStep;
    pair.high[j] += kStep;
    pair.low[2] = std::max(pair.low[2], 0.0);
    return pair;
  }

  [[nodiscard]] std::vector<Solution> grid() const {
    std::vector<Solution> found;
    for (const double constant_s : {15.0, 40.0, 100.0, 200.0, 400.0, 900.0}) {
      for (const double lag_s : {0.5, 2.5, 8.0}) {
        for (const double dead_time_s : {0.5, 2.0, 4.0, 6.0, 9.0, 14.0, 22.0, 35.0}) {
          found.push_back(at({math::log(constant_s), math::log(lag_s), dead_time_s}));
        }
      }
    }
    return found;
  }

  void refine(Solution& solution) const {
    constexpr int kMostSteps = 40;
    constexpr double kEnough = 1e-9;
    Eigen::Matrix3d normal;
    Eigen::Vector3d gradient;
    const auto linearise = [&] {
      Eigen::MatrixXd slopes(data_.size(), 3);
      for (Eigen::Index j = 0; j < 3; ++j) {
        const auto [low, high] = around(solution.p, j);
        slopes.col(j) = (at(high).residual - at(low).residual) / (high[j] - low[j]);
      }
      normal = slopes.transpose() * slopes;
      gradient = slopes.transpose() * solution.residual;
    };
    const auto attempt = [&](double lambda) -> DampedStep {
      Eigen::Matrix3d damped = normal;
      damped.diagonal() += lambda * normal.diagonal().cwiseMax(1e-12);
      const Eigen::Vector3d change = damped.ldlt().solve(-gradient).cwiseMax(-2.0).cwiseMin(2.0);
      Solution candidate = at(within_bounds(solution.p + change));
      if (!(candidate.sum < solution.sum)) {
        return {};
      }
      const bool enough = solution.sum - candidate.sum <= kEnough * solution.sum;
      solution = std::move(candidate);
      return {true, enough};
    };
    descend({.first = 1e-3, .down = 0.1, .up = 10.0, .most = 1e9}, kMostSteps, linearise, attempt);
  }

  const Log& log_;
  const FitModel& model_;
  Eigen::VectorXd data_;  // zeros for the jumps behind it
  Beginning beginning_;
  bool with_ambient_;
  std::vector<Jump> jumps_;
  Eigen::VectorXd weights_;  // of the jumps' expectations
};

// The hotend as it may have begun: at rest only if it is cold.
std::vector<Beginning> beginnings(const Log& log, const FitOptions& options) {
  constexpr double kWarm_c = 50.0;
  constexpr double kNear_c = 3.0;
  const double first_c = log.samples.front().temperature_c;
  const double first_power = log.samples.front().power;
  const bool may_rest =
      options.ambient_c ? std::abs(first_c - *options.ambient_c) < kNear_c : first_c < kWarm_c;
  std::vector<Beginning> all;
  if (may_rest) {
    all.push_back({.at_rest = true});
  }
  all.push_back({.at_rest = false, .power_before = 0.0});
  if (first_power > 0.0) {
    all.push_back({.at_rest = false, .power_before = first_power});
  }
  return all;
}

Status check(const Log& log) {
  constexpr std::size_t kFewest = 30;
  constexpr double kLeastPower = 0.05 * kFullPower;
  constexpr double kLeast_c = 10.0;
  if (log.samples.size() < kFewest) {
    return fail(ErrorKind::input, "has fewer than 30 samples; log a whole heating, once a second");
  }
  const auto [least, most] = std::ranges::minmax_element(log.samples, {}, &Sample::power);
  const auto [low, high] = std::ranges::minmax_element(log.samples, {}, &Sample::temperature_c);
  // A log may begin with the power that it keeps, behind a hotend at rest.
  const bool heats_from_rest = least->power >= kLeastPower;
  if (most->power - least->power < kLeastPower && !heats_from_rest) {
    return fail(ErrorKind::input, "has no change of power; log a heating from the cold");
  }
  if (high->temperature_c - low->temperature_c < kLeast_c) {
    return fail(ErrorKind::input,
                "has a temperature that changes by less than 10 °C; log a heating from the cold");
  }
  return {};
}

// The mean square of the residual, without the rows of the jumps.
double variance_left(const Solution& solution, Eigen::Index count) {
  return solution.residual.head(count).squaredNorm() / static_cast<double>(count);
}

double variance_of(const Eigen::VectorXd& values) {
  return (values.array() - values.mean()).square().mean();
}

PlantFit fit_of(const Log& log, const Search& search, const Solution& solution,
                const Beginning& beginning, const FitOptions& options,
                const Eigen::VectorXd& temperature_c) {
  const Eigen::MatrixXd jacobian = search.jacobian(solution);
  const Eigen::MatrixXd covariance =
      covariance_of_noise(jacobian, solution.residual) +
      covariance_of_power(jacobian, log, lags_of(solution.p), solution.linear[0]);
  const auto error = [&](Eigen::Index i) { return std::sqrt(std::max(0.0, covariance(i, i))); };
  const Lags lags = lags_of(solution.p);
  const Eigen::Index last = search.plain_unknowns() - 1;
  PlantFit fit;
  fit.gain_c = {solution.linear[0], error(3)};
  fit.time_constant_s = {lags.time_constant_s, lags.time_constant_s * error(0)};
  fit.sensor_lag_s = {lags.sensor_lag_s, lags.sensor_lag_s * error(1)};
  fit.dead_time_s = {lags.dead_time_s, error(2)};
  fit.ambient_c = options.ambient_c ? Estimate{*options.ambient_c, 0.0}
                                    : Estimate{solution.linear[last], error(3 + last)};
  fit.plant = {.gain_c = fit.gain_c.value,
               .time_constant_s = lags.time_constant_s,
               .sensor_lag_s = lags.sensor_lag_s,
               .dead_time_s = lags.dead_time_s,
               .ambient_c = fit.ambient_c.value,
               .full_power = kFullPower};
  fit.started_at_rest = beginning.at_rest;
  fit.noise_c = std::sqrt(variance_left(solution, temperature_c.size()));
  fit.unexplained = fit.noise_c / std::sqrt(variance_of(temperature_c));
  const Eigen::VectorXd fitted_c = temperature_c - solution.residual.head(temperature_c.size());
  fit.fitted_c.assign(fitted_c.begin(), fitted_c.end());
  return fit;
}

}  // namespace

Result<PlantFit> fit_plant(const Log& log, const FitOptions& options) {
  if (const Status status = check(log); !status) {
    return tl::unexpected(status.error());
  }
  const FitModel model(log);
  Eigen::VectorXd temperature_c(model.size());
  for (Eigen::Index k = 0; k < model.size(); ++k) {
    temperature_c[k] = log.samples[static_cast<std::size_t>(k)].temperature_c;
  }
  // A beginning with two more unknowns must be worth them, by Schwarz' criterion and some doubt.
  constexpr double kWorth = 12.0;
  std::optional<double> worth_of_data;  // the number of independent data that tell as much
  std::optional<PlantFit> best;
  double least = 0.0;
  for (const Beginning& beginning : beginnings(log, options)) {
    Search search(log, model, temperature_c.array() - options.ambient_c.value_or(0.0), beginning,
                  !options.ambient_c);
    const Solution solution = search.best();
    if (!worth_of_data) {
      worth_of_data = independent(solution.residual.head(model.size()));
    }
    const auto count = static_cast<double>(model.size());
    const double criterion = *worth_of_data * math::log(std::max(solution.sum / count, 1e-12)) +
                             (beginning.at_rest ? 0.0 : 2.0 * math::log(*worth_of_data) + kWorth);
    if (!best || criterion < least) {
      least = criterion;
      best = fit_of(log, search, solution, beginning, options, temperature_c);
    }
  }
  if (!(best->gain_c.value > 0.0)) {
    return fail(ErrorKind::input,
                "has a temperature that does not follow the power; check that both are of the "
                "same heater");
  }
  constexpr double kMostOpen = 0.15;
  if (best->is_explained() && !(best->gain_c.error < kMostOpen * best->gain_c.value)) {
    return fail(ErrorKind::input,
                "leaves open how far the heater can heat; log on until the temperature holds for "
                "some minutes");
  }
  return std::move(*best);
}

}  // namespace unflex::hotend
