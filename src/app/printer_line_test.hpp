// `unflex printer line-test`: writes the G-code of machine::line_test().
#pragma once

#include "console.hpp"
#include "unflex/app/run_config.hpp"
#include "unflex/core/error.hpp"

namespace unflex::app {

[[nodiscard]] Result<ExitCode> run_line_test(const RunConfig& config, Console& console);

}  // namespace unflex::app
