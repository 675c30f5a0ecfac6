// A print compensated at several accelerations.
#pragma once

#include <vector>

#include "unflex/core/error.hpp"
#include "unflex/core/progress.hpp"
#include "unflex/flow/flow.hpp"
#include "unflex/study/accels.hpp"

namespace unflex::study {

// Compensates and verifies `job.input` with each of these as limits.max_accel_mm_s2. scale:
// multiplies the accelerations that the print sets by the same ratio. The output stays in memory.
// Forks its workers first: call it before any thread exists.
[[nodiscard]] Result<study::AccelsOutcome> study_accels(const flow::Job& job,
                                                        const std::vector<double>& accels_mm_s2,
                                                        bool scale, Progress& progress);

}  // namespace unflex::study
