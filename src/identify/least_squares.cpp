#include "least_squares.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

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
  double damping = 1e-3;
  for (int step = 0; step < kMostSteps && !fit.converged; ++step) {
    fit.jacobian = derivatives(model, fit.parameters, data.size());
    const Eigen::MatrixXd weighted = weights.matrix().asDiagonal() * fit.jacobian;
    const Eigen::MatrixXd normal = fit.jacobian.transpose() * weighted;
    const Eigen::VectorXd gradient = weighted.transpose() * fit.residual.matrix();
    bool improved = false;
    for (; damping < 1e12 && !improved && !fit.converged; damping *= improved ? 0.1 : 10.0) {
      Eigen::MatrixXd damped = normal;
      damped.diagonal() += damping * normal.diagonal().cwiseMax(1e-300);
      Eigen::VectorXd change = damped.ldlt().solve(gradient);
      const double length = change.cwiseAbs().maxCoeff();
      fit.converged = length < kShortestStep;
      if (!(length <= kLongestStep)) {
        continue;
      }
      const Eigen::VectorXd candidate = fit.parameters + change;
      const Eigen::ArrayXd residual = data - model(candidate);
      const double sum = (weights * residual.square()).sum();
      if (sum <= fit.weighted_sum) {
        improved = true;
        fit.converged = fit.weighted_sum - sum <= kLeastGain * fit.weighted_sum;
        fit.parameters = candidate;
        fit.residual = residual;
        fit.weighted_sum = sum;
      }
    }
    if (!improved) {
      break;
    }
  }
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

}  // namespace

RobustFit minimise_robust(const ModelWithJacobian& model, const Eigen::ArrayXd& data, double scale,
                          const Prior& prior, Eigen::VectorXd start, int most_steps) {
  constexpr double kLongestStep = 1.0;
  constexpr double kLeastGain = 1e-7;
  constexpr double kMostDamping = 1e9;
  RobustFit fit;
  fit.parameters = start.cwiseMax(prior.low).cwiseMin(prior.high);
  Eigen::ArrayXd values;
  const auto weigh = [&] {
    fit.weights = ((fit.residual / scale).square() + 1.0).sqrt().inverse();
  };
  model(fit.parameters, values, &fit.jacobian);
  fit.residual = data - values;
  fit.loss = soft_loss(fit.residual, scale);
  fit.cost = fit.loss + prior_cost(prior, fit.parameters);
  weigh();
  double damping = 1e-2;
  bool moves = true;
  for (int step = 0; step < most_steps && moves; ++step) {
    const Eigen::MatrixXd weighted = fit.weights.matrix().asDiagonal() * fit.jacobian;
    Eigen::MatrixXd normal = fit.jacobian.transpose() * weighted;
    normal.diagonal() += prior.precision;
    Eigen::VectorXd gradient =
        weighted.transpose() * fit.residual.matrix() -
        (prior.precision.array() * (fit.parameters - prior.centre).array()).matrix();
    for (Eigen::Index i = 0; i < gradient.size(); ++i) {
      if ((fit.parameters[i] <= prior.low[i] && gradient[i] < 0.0) ||
          (fit.parameters[i] >= prior.high[i] && gradient[i] > 0.0)) {
        normal.row(i).setZero();
        normal.col(i).setZero();
        normal(i, i) = 1.0;
        gradient[i] = 0.0;
      }
    }
    moves = false;
    for (; damping < kMostDamping && !moves; damping *= moves ? 0.2 : 6.0) {
      Eigen::MatrixXd damped = normal;
      damped.diagonal() +=
          damping * normal.diagonal() + Eigen::VectorXd::Constant(gradient.size(), 1e-12);
      const Eigen::VectorXd change = damped.ldlt().solve(gradient);
      if (!(change.cwiseAbs().maxCoeff() <= kLongestStep)) {
        continue;
      }
      const Eigen::VectorXd candidate =
          (fit.parameters + change).cwiseMax(prior.low).cwiseMin(prior.high);
      model(candidate, values, nullptr);
      const Eigen::ArrayXd residual = data - values;
      const double loss = soft_loss(residual, scale);
      const double cost = loss + prior_cost(prior, candidate);
      if (cost < fit.cost) {
        moves = true;
        step = fit.cost - cost < kLeastGain * fit.cost ? most_steps : step;
        fit.parameters = candidate;
        fit.residual = residual;
        fit.loss = loss;
        fit.cost = cost;
      }
    }
    if (moves) {
      model(fit.parameters, values, &fit.jacobian);
      weigh();
    }
  }
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
