// The modes behind a whole recorded sweep.
#pragma once

#include <vector>

#include "unflex/identify/axis_model.hpp"

namespace unflex::identify {

// Whether the samples last long enough to hold a sweep; ringing is over within seconds.
[[nodiscard]] bool holds_sweep(const std::vector<double>& samples, double rate_hz);

[[nodiscard]] Result<RecordFit> fit_sweep(const std::vector<double>& samples, double rate_hz,
                                          const Sweep& sweep);

}  // namespace unflex::identify
