// Jumps of the power whose moment a log leaves open.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "fit_model.hpp"
#include "unflex/hotend/log.hpp"

namespace unflex::hotend {

// A jump between two samples, which may have come at any moment between them.
struct Jump {
  double middle_s = 0.0;  // since the log's first sample
  double width_s = 0.0;
  double power = 0.0;  // what it jumps by, counts
};

// Whether a change of power is large enough to be a jump.
[[nodiscard]] bool is_jump(double power);

// The largest jumps of a log that tells the power now and then; none if it has every change.
[[nodiscard]] std::vector<Jump> jumps_of(const Log& log);

// The temperature's columns for each jump, for a unit of K times the error of the mean power
// between the two samples: width_s h(t − middle − θ), h being the lags' impulse response.
[[nodiscard]] Eigen::MatrixXd columns_of(const std::vector<Jump>& jumps, const Log& log,
                                         const Lags& lags);

}  // namespace unflex::hotend
