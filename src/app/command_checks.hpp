// Which options of a command go together.
#pragma once

#include "unflex/app/run_config.hpp"
#include "unflex/core/error.hpp"

namespace unflex::app {

// Checks a command line that was read, and fills in what follows from it. Errors are of kind usage.
[[nodiscard]] Status complete(RunConfig& config);

}  // namespace unflex::app
