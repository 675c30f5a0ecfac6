// What a record leaves open around a fit.
#pragma once

#include "modes_model.hpp"

namespace unflex::identify {

// Sets fit.covariance, fit.intervals and fit.plants for fit.modes, which are those of θ.
void add_intervals(const ModesModel& model, const Band& band, const Prior& prior,
                   const Eigen::VectorXd& theta, ModesFit& fit);

}  // namespace unflex::identify
