// A plan made slower as a whole.
#pragma once

#include <span>
#include <vector>

#include "unflex/planner/planner.hpp"

namespace unflex::timing {

// The plan with every duration times the factor: speeds are divided by it, accelerations by its
// square, and all places stay. So a factor of at least 1 keeps every limit that the plan keeps.
[[nodiscard]] std::vector<planner::PlannedMove> stretched(
    std::span<const planner::PlannedMove> plan, double factor);

}  // namespace unflex::timing
