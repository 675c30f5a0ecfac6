// Moves that take so long that the file must be wrong.
#pragma once

#include <string>
#include <vector>

#include "unflex/core/error.hpp"
#include "unflex/planner/planner.hpp"

namespace unflex::verify {

// The first move that takes longer than an hour, which is a mistake in the file; nullptr if none
// does.
[[nodiscard]] const planner::PlannedMove* endless(const std::vector<planner::PlannedMove>& moves);

[[nodiscard]] bool is_endless(const planner::PlannedMove& move);

// An error of kind input at the move's line.
[[nodiscard]] Error endless_move(const planner::PlannedMove& move, const std::string& file);

}  // namespace unflex::verify
