// `unflex tune`: calibration by printing (docs/tune.md).
#pragma once

#include <optional>
#include <string>

#include "console.hpp"
#include "unflex/app/run_config.hpp"
#include "unflex/core/error.hpp"

namespace unflex::app {

// Reads the zones of a printed tower into the printer file, writes the next tower, or both.
[[nodiscard]] Result<ExitCode> run_tune(const RunConfig& config, Console& console);

// The kinds of towers. printed: the text of the one that has been printed, if there is one.
[[nodiscard]] Result<ExitCode> tune_axes(const RunConfig& config,
                                         const std::optional<std::string>& printed,
                                         Console& console);
[[nodiscard]] Result<ExitCode> tune_pressure(const RunConfig& config,
                                             const std::optional<std::string>& printed,
                                             Console& console);

}  // namespace unflex::app
