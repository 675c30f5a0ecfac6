// unflex translate: a print as motion of the joints.
#pragma once

#include "console.hpp"
#include "unflex/app/run_config.hpp"
#include "unflex/core/error.hpp"

namespace unflex::app {

[[nodiscard]] Result<ExitCode> run_translate(const RunConfig& config, Console& console);

}  // namespace unflex::app
