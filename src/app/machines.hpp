// `unflex study IN --machines DIR`: unflex and input shapers on the machines that records tell of.
#pragma once

#include "console.hpp"
#include "unflex/app/run_config.hpp"
#include "unflex/core/error.hpp"

namespace unflex::app {

[[nodiscard]] Result<ExitCode> run_machines(const RunConfig& config, Console& console);

}  // namespace unflex::app
