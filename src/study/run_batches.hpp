// The runs of a print as the study takes them.
#pragma once

#include <functional>
#include <vector>

#include "unflex/core/error.hpp"
#include "unflex/core/progress.hpp"
#include "unflex/flow/flow.hpp"
#include "unflex/study/bench.hpp"

namespace unflex::study {

// Plans the print as `compensate` does and hands its runs on, some at a time: enough for all
// threads, and little memory. Returns the warnings. Errors are those of reading, and of a print
// without a run.
[[nodiscard]] Result<std::vector<Diagnostic>> for_each_batch(
    const flow::Job& job, Progress& progress,
    const std::function<void(std::vector<study::Run>&&)>& use);

}  // namespace unflex::study
