// `unflex study IN --map`: the best single shaper for the whole bed against one optimum per place.
#pragma once

#include "console.hpp"
#include "unflex/app/run_config.hpp"
#include "unflex/core/error.hpp"

namespace unflex::app {

[[nodiscard]] Result<ExitCode> run_map_study(const RunConfig& config, Console& console);

}  // namespace unflex::app
