// Notation
//   J     Jacobian of the temperatures by the unknowns; A = (JᵀJ)⁻¹Jᵀ
//   e_j   error of the power between samples j and j + 1, which are w_j apart around the time m_j
//   h(t)  impulse response of the lags, (e^(−t/τ₁) − e^(−t/τ₂)) / (τ₁ − τ₂) for t > 0
//
// An error e_j moves the temperature at t_k by K w_j h(t_k − m_j − θ) e_j, and so the unknowns by
//   v_j e_j,   v_j = K w_j Σ_k A_k h(t_k − m_j − θ),
// so that their covariance is Σ_j v_j v_jᵀ var e_j. The sums of exponentials are gathered from the
// last sample back to the first.
#include "fit_errors.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "jumps.hpp"
#include "unflex/core/math.hpp"

namespace unflex::hotend {
namespace {

// (JᵀJ)⁻¹, by columns of the same size.
Eigen::MatrixXd inverse_normal(const Eigen::MatrixXd& jacobian) {
  constexpr double kLeastSize = 1e-12;
  constexpr double kRidge = 1e-13;
  const Eigen::VectorXd scale =
      jacobian.colwise().norm().transpose().cwiseMax(kLeastSize).cwiseInverse();
  const Eigen::MatrixXd scaled = jacobian * scale.asDiagonal();
  Eigen::MatrixXd normal = scaled.transpose() * scaled;
  normal.diagonal().array() += kRidge;
  const Eigen::MatrixXd inverse =
      normal.ldlt().solve(Eigen::MatrixXd::Identity(normal.rows(), normal.cols()));
  return scale.asDiagonal() * inverse * scale.asDiagonal();
}

// Σ A_k e^(−(t_k − s)/τ) over the samples later than s, for s that goes back in time.
class FadingSum {
 public:
  FadingSum(const Eigen::MatrixXd& weights, const Log& log, double constant_s)
      : weights_(weights),
        log_(log),
        constant_s_(constant_s),
        next_(log.samples.size()),
        at_s_(log.samples.back().time_s),
        sum_(Eigen::VectorXd::Zero(weights.rows())) {}

  const Eigen::VectorXd& back_to(double time_s) {
    while (next_ > 0 && log_.samples[next_ - 1].time_s > time_s) {
      --next_;
      fade_to(log_.samples[next_].time_s);
      sum_ += weights_.col(static_cast<Eigen::Index>(next_));
    }
    fade_to(std::min(time_s, at_s_));
    return sum_;
  }

 private:
  void fade_to(double time_s) {
    sum_ *= math::exp(-(at_s_ - time_s) / constant_s_);
    at_s_ = time_s;
  }

  const Eigen::MatrixXd& weights_;
  const Log& log_;
  double constant_s_;
  std::size_t next_;  // the samples from here on are in the sum
  double at_s_;
  Eigen::VectorXd sum_;
};

}  // namespace

double independent(const Eigen::VectorXd& residual) {
  constexpr double kMostCorrelated = 0.98;
  constexpr double kLeastSum = 1e-300;
  const Eigen::Index count = residual.size();
  const double neighbours = residual.head(count - 1).dot(residual.tail(count - 1)) /
                            std::max(residual.squaredNorm(), kLeastSum);
  const double correlation = std::clamp(neighbours, 0.0, kMostCorrelated);
  return static_cast<double>(count) * (1.0 - correlation) / (1.0 + correlation);
}

Eigen::MatrixXd covariance_of_noise(const Eigen::MatrixXd& jacobian,
                                    const Eigen::VectorXd& residual) {
  const auto count = static_cast<double>(residual.size());
  const double variance = residual.squaredNorm() / (count - static_cast<double>(jacobian.cols()));
  return variance * count / independent(residual) * inverse_normal(jacobian);
}

Eigen::MatrixXd covariance_of_power(const Eigen::MatrixXd& jacobian, const Log& log,
                                    const Lags& lags, double gain_c) {
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(jacobian.cols(), jacobian.cols());
  const double apart_s = lags.time_constant_s - lags.sensor_lag_s;
  if (log.hold == Hold::to_next || apart_s <= 0.0) {
    return covariance;
  }
  const Eigen::MatrixXd weights = inverse_normal(jacobian) * jacobian.transpose();
  FadingSum block(weights, log, lags.time_constant_s);
  FadingSum sensor(weights, log, lags.sensor_lag_s);
  for (std::size_t j = log.samples.size() - 1; j-- > 0;) {
    const Sample& from = log.samples[j];
    const Sample& to = log.samples[j + 1];
    const double felt_s = 0.5 * (from.time_s + to.time_s) + lags.dead_time_s;
    const Eigen::VectorXd moved = gain_c * (to.time_s - from.time_s) / apart_s *
                                  (block.back_to(felt_s) - sensor.back_to(felt_s));
    const double change = to.power - from.power;
    const double uncertain = is_jump(change) ? 0.0 : 0.5 * change;
    covariance += uncertain * uncertain * moved * moved.transpose();
  }
  return covariance;
}

}  // namespace unflex::hotend
