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

// Minimises Σ w (data − model(θ))² from a start by Levenberg's and Marquardt's method.
// Derivatives are central differences of 1e-5, so parameters must be of the order of 1.
[[nodiscard]] LeastSquares minimise(const Model& model, const Eigen::ArrayXd& data,
                                    const Eigen::ArrayXd& weights, Eigen::VectorXd start);

// Values of the model and their derivatives, data × parameters.
using ModelWithJacobian =
    std::function<void(const Eigen::VectorXd&, Eigen::ArrayXd& values, Eigen::MatrixXd* jacobian)>;

// Bounds of the parameters, and the knowledge before the fit: centre and precision of each.
struct Prior {
  Eigen::VectorXd low;
  Eigen::VectorXd high;
  Eigen::VectorXd centre;
  Eigen::VectorXd precision;  // in units of the loss
};

struct RobustFit {
  Eigen::VectorXd parameters;
  Eigen::MatrixXd jacobian;
  Eigen::ArrayXd residual;
  Eigen::ArrayXd weights;  // 1 / √(1 + r²/s²)
  double loss = 0.0;       // of the data alone
  double cost = 0.0;       // with the prior
};

// Σ 2s² (√(1 + r²/s²) − 1) over residuals r.
[[nodiscard]] double soft_loss(const Eigen::ArrayXd& residual, double scale);

// Minimises the soft L1 loss Σ 2s² (√(1 + r²/s²) − 1) plus Σ precision (θ − centre)² within bounds,
// by Levenberg's and Marquardt's method with weights of its own for each step. Parameters on a
// bound that want to leave it are held.
[[nodiscard]] RobustFit minimise_robust(const ModelWithJacobian& model, const Eigen::ArrayXd& data,
                                        double scale, const Prior& prior, Eigen::VectorXd start,
                                        int most_steps);

// Covariance of the parameters. It holds whatever the variances of the residuals are, also if
// neighbours in blocks of `block` data go together (White, A Heteroskedasticity-Consistent
// Covariance Matrix Estimator, Econometrica 1980, with clusters):
//   (JᵀWJ)⁻¹ Σ_blocks g gᵀ (JᵀWJ)⁻¹,   g = Σ_block w r J.
// Each variance is at least the one that blocks of one give.
[[nodiscard]] Eigen::MatrixXd sandwich(const LeastSquares& fit, const Eigen::ArrayXd& weights,
                                       Eigen::Index block);

}  // namespace unflex::identify
