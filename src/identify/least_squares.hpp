// Weighted nonlinear least squares with few unknowns.
#pragma once

#include <Eigen/Core>
#include <functional>

namespace unflex::identify {

// Values of the model at the data's places, for some parameters.
using Model = std::function<Eigen::ArrayXd(const Eigen::VectorXd&)>;

struct LeastSquares {
  Eigen::VectorXd parameters;
  Eigen::MatrixXd jacobian;   // of the model, data × parameters
  Eigen::ArrayXd residual;    // data − model
  double weighted_sum = 0.0;  // Σ w r²
  bool converged = false;
};

// Minimises Σ w (data − model(θ))² from a start by Levenberg's and Marquardt's method (Marquardt,
// An Algorithm for Least-Squares Estimation of Nonlinear Parameters, 1963). Derivatives are central
// differences of 1e-5, so parameters must be of the order of 1.
[[nodiscard]] LeastSquares minimise(const Model& model, const Eigen::ArrayXd& data,
                                    const Eigen::ArrayXd& weights, Eigen::VectorXd start);

// Covariance of the parameters. It holds whatever the variances of the residuals are, also if
// neighbours in blocks of `block` data go together (White, A Heteroskedasticity-Consistent
// Covariance Matrix Estimator, Econometrica 1980, with clusters):
//   (JᵀWJ)⁻¹ Σ_blocks g gᵀ (JᵀWJ)⁻¹,   g = Σ_block w r J.
[[nodiscard]] Eigen::MatrixXd sandwich(const LeastSquares& fit, const Eigen::ArrayXd& weights,
                                       Eigen::Index block);

}  // namespace unflex::identify
