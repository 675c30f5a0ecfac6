// One print of a batch, in the process that works on it.
#pragma once

#include <optional>

#include "batch_result.hpp"
#include "unflex/app/run_config.hpp"

namespace unflex::app {

// Compensates the print of `config` (as for `unflex compensate`), unless `known` and the files that
// are there show that this has been done. Nothing goes to the terminal.
[[nodiscard]] BatchAnswer work_on_batch_print(const RunConfig& config,
                                              const std::vector<BatchRecord>& known);

}  // namespace unflex::app
