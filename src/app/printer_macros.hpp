// `unflex printer macros`: macros that let a pause wait for the end of a compensated run.
#pragma once

#include "unflex/app/run_config.hpp"
#include "unflex/core/error.hpp"

namespace unflex::app {

// Refused for firmwares whose pause no macro can defer.
[[nodiscard]] Result<ExitCode> run_printer_macros(const RunConfig& config);

}  // namespace unflex::app
