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

Eigen::MatrixXd sandwich(const LeastSquares& fit, const Eigen::ArrayXd& weights,
                         Eigen::Index block) {
  const Eigen::Index unknowns = fit.parameters.size();
  const Eigen::MatrixXd weighted = weights.matrix().asDiagonal() * fit.jacobian;
  const Eigen::MatrixXd bread = (fit.jacobian.transpose() * weighted)
                                    .ldlt()
                                    .solve(Eigen::MatrixXd::Identity(unknowns, unknowns));
  Eigen::MatrixXd filling = Eigen::MatrixXd::Zero(unknowns, unknowns);
  for (Eigen::Index at = 0; at < fit.residual.size(); at += block) {
    const Eigen::Index count = std::min(block, fit.residual.size() - at);
    const Eigen::VectorXd g =
        weighted.middleRows(at, count).transpose() * fit.residual.segment(at, count).matrix();
    filling += g * g.transpose();
  }
  return bread * filling * bread;
}

}  // namespace unflex::identify
