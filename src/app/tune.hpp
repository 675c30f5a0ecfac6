// `unflex tune`: calibration by printing (docs/tune.md).
#pragma once

#include "console.hpp"
#include "unflex/app/run_config.hpp"
#include "unflex/core/error.hpp"

namespace unflex::app {

// Reads the zones of a printed tower into the printer file, writes the next tower, or both.
[[nodiscard]] Result<ExitCode> run_tune(const RunConfig& config, Console& console);

}  // namespace unflex::app
