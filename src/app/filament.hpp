// Prints whose E is fitted to a filament that is not a full cylinder.
#pragma once

#include <optional>
#include <string>

#include "console.hpp"
#include "inputs.hpp"
#include "unflex/app/run_config.hpp"
#include "unflex/core/error.hpp"
#include "unflex/filament/fit_filament.hpp"
#include "unflex/machine/machine.hpp"

namespace unflex::app {

// The profile's file, if the settings name one. A name in the printer file counts from that file's
// folder.
[[nodiscard]] std::optional<std::string> filament_profile(const RunConfig& config,
                                                          const machine::Settings& settings);

// Fits the input, if the settings ask for it. nullopt: they do not. Errors include those of the
// profile.
[[nodiscard]] Result<std::optional<filament::FittedPrint>> fit_to_filament(
    const RunConfig& config, const machine::Settings& settings, Input& input);

// unflex filament
[[nodiscard]] Result<ExitCode> run_filament(const RunConfig& config, Console& console);

}  // namespace unflex::app
