// The uncertainty of a fit.
#pragma once

#include <Eigen/Core>

#include "fit_model.hpp"
#include "unflex/hotend/log.hpp"

namespace unflex::hotend {

// The number of independent data in a residual. Residuals are correlated from sample to sample, so
// n data are worth n (1 − ρ)/(1 + ρ), ρ being the correlation of neighbours.
[[nodiscard]] double independent(const Eigen::VectorXd& residual);

// Covariance of the unknowns by their Jacobian, data × unknowns, and by the residual.
[[nodiscard]] Eigen::MatrixXd covariance_of_noise(const Eigen::MatrixXd& jacobian,
                                                  const Eigen::VectorXd& residual);

// Covariance of the unknowns from the power that is not known between the samples. It matters for a
// log that tells the power now and then, and is zero if the log has every change. Where two samples
// differ by d, the mean between them is taken to be uncertain by d/2.
[[nodiscard]] Eigen::MatrixXd covariance_of_power(const Eigen::MatrixXd& jacobian, const Log& log,
                                                  const Lags& lags, double gain_c);

}  // namespace unflex::hotend
