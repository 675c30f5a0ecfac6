// The mode behind the ringing after a move. `known`: modes that may ring along, at least 25 % away
// from the one that is looked for.
#pragma once

#include <vector>

#include "unflex/identify/axis_model.hpp"

namespace unflex::identify {

inline constexpr double kApartOfKnown = 0.25;

[[nodiscard]] Result<RecordFit> fit_ringing(const std::vector<double>& samples, double rate_hz,
                                            const std::vector<ModeOfAxis>& known = {});

}  // namespace unflex::identify
