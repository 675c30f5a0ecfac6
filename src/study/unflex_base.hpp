// The base as unflex moves it.
#pragma once

#include <vector>

#include "unflex/study/bench.hpp"

namespace unflex::study {

// `parts` parabolas for each node interval. An error of kind internal if there is no solution.
[[nodiscard]] Result<BaseMotion> unflex_base(const compensate::Setup& setup,
                                             const std::vector<planner::PlannedMove>& plan,
                                             int parts, const compensate::Engine& engine);

}  // namespace unflex::study
