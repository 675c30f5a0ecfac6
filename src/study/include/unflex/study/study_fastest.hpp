// How fast a print may go within a tolerance.
#pragma once

#include <vector>

#include "unflex/core/error.hpp"
#include "unflex/core/progress.hpp"
#include "unflex/flow/flow.hpp"
#include "unflex/study/fastest.hpp"

namespace unflex::study {

// The settings for the study. unflex is made for the exact frequencies, unless the settings say how
// far these may be off.
[[nodiscard]] machine::Settings settings_of_fastest(machine::Settings settings);

// Searches the least print time of `job.input` for each tolerance, on the nozzle of the job's
// settings. Speeds are those of the file, up to the velocity limit of settings and file; what the
// file says of acceleration and corners is obeyed for the plan as sliced alone. The whole path is
// in memory meanwhile. unflex compensates the print with each tolerance; what it writes is dropped.
// Forks its workers first: call it before any thread exists.
[[nodiscard]] Result<study::FastestOutcome> study_fastest(const flow::Job& job,
                                                          const std::vector<double>& tolerances_mm,
                                                          const study::ToleranceRule& rule,
                                                          Progress& progress);

}  // namespace unflex::study
