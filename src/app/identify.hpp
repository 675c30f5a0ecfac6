// `unflex identify`: from records to frequency and damping.
#pragma once

#include "console.hpp"
#include "unflex/app/run_config.hpp"
#include "unflex/core/error.hpp"

namespace unflex::app {

[[nodiscard]] Result<ExitCode> run_identify(const RunConfig& config, Console& console);

}  // namespace unflex::app
