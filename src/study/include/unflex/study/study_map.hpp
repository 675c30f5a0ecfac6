// The bench of places on a print.
#pragma once

#include "unflex/core/error.hpp"
#include "unflex/core/progress.hpp"
#include "unflex/flow/flow.hpp"
#include "unflex/study/map_bench.hpp"

namespace unflex::study {

// Tries all contenders on the runs of `job.input`, as if the print lay at each of up to nine places
// of the job's maps over the bed. An error of kind usage if the settings have no such map.
[[nodiscard]] Result<MapOutcome> study_map(const flow::Job& job, Progress& progress);

}  // namespace unflex::study
