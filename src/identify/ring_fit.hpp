// The mode behind the ringing after a move.
#pragma once

#include <vector>

#include "unflex/identify/mode.hpp"

namespace unflex::identify {

[[nodiscard]] Result<Mode> fit_ringing(const std::vector<double>& samples, double rate_hz);

}  // namespace unflex::identify
