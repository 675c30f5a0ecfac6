// `unflex batch`: every print of a folder.
#pragma once

#include "console.hpp"
#include "unflex/app/run_config.hpp"
#include "unflex/core/error.hpp"

namespace unflex::app {

// Call it before any thread exists. The exit code is the worst print's.
[[nodiscard]] Result<ExitCode> run_batch(const RunConfig& config, Console& console);

}  // namespace unflex::app
