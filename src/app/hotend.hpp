// unflex hotend: from a log of a heating, a test, or a printer's model to a controller's gains.
#pragma once

#include "console.hpp"
#include "unflex/app/run_config.hpp"

namespace unflex::app {

[[nodiscard]] Result<ExitCode> run_hotend(const RunConfig& config, Console& console);

}  // namespace unflex::app
