// The mode behind the ringing after a move.
#pragma once

#include <vector>

#include "unflex/identify/axis_model.hpp"

namespace unflex::identify {

[[nodiscard]] Result<RecordFit> fit_ringing(const std::vector<double>& samples, double rate_hz);

}  // namespace unflex::identify
