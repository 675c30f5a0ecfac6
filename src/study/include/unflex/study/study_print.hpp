// The study's bench on a print instead of the thesis' corner.
#pragma once

#include "unflex/core/error.hpp"
#include "unflex/core/progress.hpp"
#include "unflex/flow/flow.hpp"
#include "unflex/study/study.hpp"

namespace unflex::study {

// Tries all methods on every run of `job.input`, planned as `compensate` plans it, with the job's
// settings; unflex' acceleration limits are multiples of limits.max_accel_mm_s2. Every run begins
// with the nozzle at rest. Nothing is written as G-code: bases move exactly as each method has
// them. traces: also record the worst place, for the figures.
[[nodiscard]] Result<study::Outcome> study_print(const flow::Job& job, bool traces,
                                                 Progress& progress);

}  // namespace unflex::study
