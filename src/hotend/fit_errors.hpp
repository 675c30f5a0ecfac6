// How sure a fit is.
#pragma once

#include <Eigen/Core>

#include "fit_model.hpp"
#include "unflex/hotend/log.hpp"

namespace unflex::hotend {

// What is left goes together from sample to sample, which makes n data worth n (1 − ρ)/(1 + ρ), ρ
// being the correlation of neighbours.
[[nodiscard]] double independent(const Eigen::VectorXd& residual);

// Covariance of the unknowns by their Jacobian, data × unknowns, and by what is left.
[[nodiscard]] Eigen::MatrixXd covariance_of_noise(const Eigen::MatrixXd& jacobian,
                                                  const Eigen::VectorXd& residual);

// Covariance of the same unknowns from what is not known of the power between the samples of a log
// that tells it now and then: nothing if it has every change. Where two samples differ by d, the
// mean between them is taken to be uncertain by d/2.
[[nodiscard]] Eigen::MatrixXd covariance_of_power(const Eigen::MatrixXd& jacobian, const Log& log,
                                                  const Lags& lags, double gain_c);

}  // namespace unflex::hotend
