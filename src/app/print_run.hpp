// `unflex compensate` and `unflex verify`: one print from its file to the verdict on it.
#pragma once

#include "console.hpp"
#include "unflex/app/run_config.hpp"
#include "unflex/core/error.hpp"
#include "unflex/report/report.hpp"

namespace unflex::app {

struct PrintOutcome {
  ExitCode verdict = ExitCode::done;
  report::Report report;
};

// Does all but the summary. When it returns, output and report are in place, or as they were.
[[nodiscard]] Result<PrintOutcome> work_on_print(const RunConfig& config, Console& console);

// Works on the print and prints the summary.
[[nodiscard]] Result<ExitCode> run_on_print(const RunConfig& config, Console& console);

}  // namespace unflex::app
