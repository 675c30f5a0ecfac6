// The plant's answer to a log's power, as columns for the linear unknowns.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "unflex/hotend/log.hpp"

namespace unflex::hotend {

// The unknowns that are not linear.
struct Lags {
  double time_constant_s = 0.0;
  double sensor_lag_s = 0.0;
  double dead_time_s = 0.0;
};

// How a log begins.
struct Beginning {
  bool at_rest = false;       // at ambient; otherwise T₁ and T are unknowns
  double power_before = 0.0;  // counts, for as long as the dead time
};

class FitModel {
 public:
  explicit FitModel(const Log& log);

  [[nodiscard]] Eigen::Index size() const { return static_cast<Eigen::Index>(time_s_.size()); }

  // Columns of the temperature above ambient at the log's times: for K = 1 and, if the log does not
  // begin at rest, for T₁ = 1 and T = 1 at its beginning. A column of ones follows if the ambient
  // temperature is an unknown.
  [[nodiscard]] Eigen::MatrixXd columns(const Lags& lags, const Beginning& beginning,
                                        bool with_ambient) const;

 private:
  std::vector<double> time_s_;  // of samples, from 0 on
  struct Change {
    double time_s = 0.0;
    double power = 0.0;
  };
  std::vector<Change> changes_;  // of the power, after the first
  double first_power_ = 0.0;
};

}  // namespace unflex::hotend
