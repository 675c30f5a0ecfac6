// The mode behind a whole recorded sweep.
#pragma once

#include <vector>

#include "unflex/identify/mode.hpp"

namespace unflex::identify {

// Whether the samples hold a sweep: seconds of motion over a wide band.
[[nodiscard]] bool holds_sweep(const std::vector<double>& samples, double rate_hz,
                               const Sweep& sweep);

[[nodiscard]] Result<Mode> fit_sweep(const std::vector<double>& samples, double rate_hz,
                                     const Sweep& sweep);

}  // namespace unflex::identify
