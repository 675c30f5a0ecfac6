// The files and settings of a command on a print. They are opened and checked before the long work
// begins.
#pragma once

#include <optional>

#include "inputs.hpp"
#include "outputs.hpp"
#include "unflex/app/run_config.hpp"
#include "unflex/core/error.hpp"
#include "unflex/filament/fit_filament.hpp"
#include "unflex/flow/flow.hpp"
#include "unflex/machine/machine.hpp"

namespace unflex::app {

struct Workspace {
  machine::Settings settings;
  Input input;
  std::optional<filament::FittedPrint> fitted;  // where the input is fitted to its filament
  std::optional<Input> compensated;             // only for verify
  std::optional<Output> output;                 // only for compensate
  std::optional<Output> report;
};

// The settings in force for the print that is read. Settings that rest on a guess are refused.
[[nodiscard]] Result<machine::Settings> load_settings(const RunConfig& config, Input& input);

// Opens the prints, the output and the report, and reads the settings.
[[nodiscard]] Result<Workspace> open_workspace(const RunConfig& config);

// An error if a print was changed meanwhile, since the change explains any other failure.
[[nodiscard]] Status check_inputs(const Workspace& space);

// Has the output packed like the input, or as its name says.
void pack_output(const RunConfig& config, Workspace& space);

// The job for flow::compensate().
[[nodiscard]] Result<flow::Job> job_of(const RunConfig& config, Workspace& space);

}  // namespace unflex::app
