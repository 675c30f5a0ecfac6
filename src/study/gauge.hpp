// A base's motion measured by the nozzle that hangs on it.
#pragma once

#include <vector>

#include "unflex/study/bench.hpp"

namespace unflex::study {

// frequency_error: of the true axes against those of the setup.
[[nodiscard]] Straying straying(const BaseMotion& base,
                                const std::vector<planner::PlannedMove>& plan,
                                const BenchSetup& setup, double frequency_error);

}  // namespace unflex::study
