#include "least_squares.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "unflex/core/levenberg_marquardt.hpp"

namespace unflex::identify {
namespace {

Eigen::MatrixXd derivatives(const Model& model, const Eigen::VectorXd& at, Eigen::Index rows) {
  constexpr double kStep = 1e-5;
  Eigen::MatrixXd jacobian(rows, at.size());
  for (Eigen::Index j = 0; j < at.size(); ++j) {
    Eigen::VectorXd shifted = at;
    shifted[j] = at[j] + kStep;
    const Eigen::ArrayXd above = model(shifted);
    shifted[j] = at[j] - kStep;
    jacobian.col(j) = ((above - model(shifted)) / (2.0 * kStep)).matrix();
  }
  return jacobian;
}

}  // namespace

LeastSquares minimise(const Model& model, const Eigen::ArrayXd& data, const Eigen::ArrayXd& weights,
                      Eigen::VectorXd start) {
  constexpr int kMostSteps = 60;
  constexpr double kLongestStep = 1.0;
  constexpr double kShortestStep = 1e-8;
  constexpr double kLeastGain = 1e-9;
  LeastSquares fit;
  fit.parameters = std::move(start);
  fit.residual = data - model(fit.parameters);
  fit.weighted_sum = (weights * fit.residual.square()).sum();
  Eigen::MatrixXd normal;
  Eigen::VectorXd gradient;
  const auto linearise = [&] {
    fit.jacobian = derivatives(model, fit.parameters, data.size());
    const Eigen::MatrixXd weighted = weights.matrix().asDiagonal() * fit.jacobian;
    normal = fit.jacobian.transpose() * weighted;
    gradient = weighted.transpose() * fit.residual.matrix();
  };
  const auto attempt = [&](double lambda) -> DampedStep {
    Eigen::MatrixXd damped = normal;
    damped.diagonal() += lambda * normal.diagonal().cwiseMax(1e-300);
    const Eigen::VectorXd change = damped.ldlt().solve(gradient);
    const double length = change.cwiseAbs().maxCoeff();
    fit.converged = length < kShortestStep;
    if (!(length <= kLongestStep)) {
      return {false, fit.converged};
    }
    const Eigen::VectorXd candidate = fit.parameters + change;
    const Eigen::ArrayXd residual = data - model(candidate);
    const double sum = (weights * residual.square()).sum();
    if (!(sum <= fit.weighted_sum)) {
      return {false, fit.converged};
    }
    fit.converged = fit.weighted_sum - sum <= kLeastGain * fit.weighted_sum;
    fit.parameters = candidate;
    fit.residual = residual;
    fit.weighted_sum = sum;
    return {true, fit.converged};
  };
  descend({.first = 1e-3, .down = 0.1, .up = 10.0, .most = 1e12}, kMostSteps, linearise, attempt);
  fit.jacobian = derivatives(model, fit.parameters, data.size());
  return fit;
}

double soft_loss(const Eigen::ArrayXd& residual, double scale) {
  return 2.0 * scale * scale * (((residual / scale).square() + 1.0).sqrt() - 1.0).sum();
}

namespace {

double prior_cost(const Prior& prior, const Eigen::VectorXd& at) {
  return (prior.precision.array() * (at - prior.centre).array().square()).sum();
}

// Takes those parameters out of the step that are on a bound and want to leave it.
void hold_on_bounds(const Prior& prior, const Eigen::VectorXd& at, Eigen::MatrixXd& normal,
                    Eigen::VectorXd& gradient) {
  for (Eigen::Index i = 0; i < gradient.size(); ++i) {
    if ((at[i] <= prior.low[i] && gradient[i] < 0.0) ||
        (at[i] >= prior.high[i] && gradient[i] > 0.0)) {
      normal.row(i).setZero();
      normal.col(i).setZero();
      normal(i, i) = 1.0;
      gradient[i] = 0.0;
    }
  }
}

}  // namespace

RobustFit minimise_robust(const ModelWithJacobian& model, const Eigen::ArrayXd& data, double scale,
                          const Prior& prior, Eigen::VectorXd start, int most_steps) {
  constexpr double kLongestStep = 1.0;
  constexpr double kLeastGain = 1e-7;
  RobustFit fit;
  fit.parameters = start.cwiseMax(prior.low).cwiseMin(prior.high);
  Eigen::ArrayXd values;
  const auto look = [&] {
    model(fit.parameters, values, &fit.jacobian);
    fit.weights = ((fit.residual / scale).square() + 1.0).sqrt().inverse();
  };
  model(fit.parameters, values, nullptr);
  fit.residual = data - values;
  fit.loss = soft_loss(fit.residual, scale);
  fit.cost = fit.loss + prior_cost(prior, fit.parameters);
  Eigen::MatrixXd normal;
  Eigen::VectorXd gradient;
  const auto linearise = [&] {
    look();
    const Eigen::MatrixXd weighted = fit.weights.matrix().asDiagonal() * fit.jacobian;
    normal = fit.jacobian.transpose() * weighted;
    normal.diagonal() += prior.precision;
    gradient = weighted.transpose() * fit.residual.matrix() -
               (prior.precision.array() * (fit.parameters - prior.centre).array()).matrix();
    hold_on_bounds(prior, fit.parameters, normal, gradient);
  };
  const auto attempt = [&](double lambda) -> DampedStep {
    Eigen::MatrixXd damped = normal;
    damped.diagonal() +=
        lambda * normal.diagonal() + Eigen::VectorXd::Constant(gradient.size(), 1e-12);
    const Eigen::VectorXd change = damped.ldlt().solve(gradient);
    if (!(change.cwiseAbs().maxCoeff() <= kLongestStep)) {
      return {};
    }
    const Eigen::VectorXd candidate =
        (fit.parameters + change).cwiseMax(prior.low).cwiseMin(prior.high);
    model(candidate, values, nullptr);
    const Eigen::ArrayXd residual = data - values;
    const double loss = soft_loss(residual, scale);
    const double cost = loss + prior_cost(prior, candidate);
    if (!(cost < fit.cost)) {
      return {};
    }
    const bool gains = fit.cost - cost >= kLeastGain * fit.cost;
    fit.parameters = candidate;
    fit.residual = residual;
    fit.loss = loss;
    fit.cost = cost;
    return {true, !gains};
  };
  descend({.first = 1e-2, .down = 0.2, .up = 6.0, .most = 1e9}, most_steps, linearise, attempt);
  look();
  return fit;
}

Eigen::MatrixXd sandwich(const LeastSquares& fit, const Eigen::ArrayXd& weights,
                         Eigen::Index block) {
  const Eigen::Index unknowns = fit.parameters.size();
  const Eigen::MatrixXd weighted = weights.matrix().asDiagonal() * fit.jacobian;
  Eigen::MatrixXd normal = fit.jacobian.transpose() * weighted;
  // A parameter that the data do not depend on must not spoil the others.
  normal.diagonal().array() += 1e-12 * normal.diagonal().maxCoeff();
  const Eigen::MatrixXd bread = normal.ldlt().solve(Eigen::MatrixXd::Identity(unknowns, unknowns));
  const auto in_blocks = [&](Eigen::Index of) -> Eigen::MatrixXd {
    Eigen::MatrixXd filling = Eigen::MatrixXd::Zero(unknowns, unknowns);
    for (Eigen::Index at = 0; at < fit.residual.size(); at += of) {
      const Eigen::Index count = std::min(of, fit.residual.size() - at);
      const Eigen::VectorXd g =
          weighted.middleRows(at, count).transpose() * fit.residual.segment(at, count).matrix();
      filling += g * g.transpose();
    }
    return bread * filling * bread;
  };
  const Eigen::MatrixXd together = in_blocks(block);
  const Eigen::ArrayXd least = in_blocks(1).diagonal();
  const Eigen::ArrayXd own = together.diagonal();
  const Eigen::VectorXd stretch =
      (own > 0.0).select((least.max(own) / own).sqrt(), Eigen::ArrayXd::Ones(unknowns)).matrix();
  return stretch.asDiagonal() * together * stretch.asDiagonal();
}

}  // namespace unflex::identify
