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

// All but the summary: output and report are in place when it returns, or as they were.
[[nodiscard]] Result<PrintOutcome> work_on_print(const RunConfig& config, Console& console);

// The same with its summary.
[[nodiscard]] Result<ExitCode> run_on_print(const RunConfig& config, Console& console);

}  // namespace unflex::app
