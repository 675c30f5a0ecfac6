// `unflex printer init`: a printer file from what already describes the printer.
#pragma once

#include "console.hpp"
#include "unflex/app/run_config.hpp"
#include "unflex/core/error.hpp"

namespace unflex::app {

[[nodiscard]] Result<ExitCode> run_printer_init(const RunConfig& config, Console& console);

}  // namespace unflex::app
