// What a record leaves open around a fit.
#pragma once

#include "modes_model.hpp"

namespace unflex::identify {

// Sets fit.covariance, fit.intervals and fit.plants for fit.modes, which are those of θ.
// `spread` is the covariance of (log f, log ζ, g) among other fits, and adds to that of this one.
void add_intervals(const ModesModel& model, const Band& band, const Prior& prior,
                   const Eigen::VectorXd& theta, const Eigen::MatrixXd& spread, ModesFit& fit);

}  // namespace unflex::identify
