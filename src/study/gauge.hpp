// Measures a base's motion by the nozzle that hangs on it.
#pragma once

#include <vector>

#include "unflex/study/bench.hpp"

namespace unflex::study {

// frequency_error: relative error of the true frequencies against those of the setup.
[[nodiscard]] Straying straying(const BaseMotion& base,
                                const std::vector<planner::PlannedMove>& plan,
                                const BenchSetup& setup, double frequency_error);

}  // namespace unflex::study
