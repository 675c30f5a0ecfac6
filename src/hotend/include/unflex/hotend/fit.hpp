// A plant found in a log of temperature and power.
#pragma once

#include <optional>
#include <vector>

#include "unflex/core/error.hpp"
#include "unflex/hotend/log.hpp"
#include "unflex/hotend/plant.hpp"

namespace unflex::hotend {

// A value and its standard error.
struct Estimate {
  double value = 0.0;
  double error = 0.0;
};

// Above this share of the temperature's variation the log is not one of this model.
inline constexpr double kMostUnexplained = 0.05;

struct PlantFit {
  Plant plant;
  Estimate gain_c;
  Estimate time_constant_s;
  Estimate sensor_lag_s;
  Estimate dead_time_s;
  Estimate ambient_c;        // its error is 0 if it was given
  double noise_c = 0.0;      // standard deviation of what is left
  double unexplained = 0.0;  // noise_c over the standard deviation of the temperature
  bool started_at_rest = false;
  std::vector<double> fitted_c;  // the model at the log's times

  [[nodiscard]] bool is_explained() const { return unexplained <= kMostUnexplained; }
};

struct FitOptions {
  std::optional<double> ambient_c;  // fitted if it is not given
};

// Fits K, τ₁, τ₂, θ, and the ambient temperature unless it is given. The log's samples must be in
// order of time and may be uneven. It may begin with a hotend that rests cold or with one in any
// other state; the likelier one is taken.
//
// Errors are of kind input: there are too few samples, the power or the temperature hardly changes,
// the temperature does not follow the power, or the log leaves K open although the
// model explains it.
[[nodiscard]] Result<PlantFit> fit_plant(const Log& log, const FitOptions& options = {});

}  // namespace unflex::hotend
