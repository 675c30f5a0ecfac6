// Adds the commands that find out about a printer, with their options.
#pragma once

#include <CLI/CLI.hpp>

#include "unflex/app/run_config.hpp"

namespace unflex::app {

void add_identify(CLI::App& program, RunConfig& config);
void add_tune(CLI::App& program, RunConfig& config);
void add_hotend(CLI::App& program, RunConfig& config);
void add_kinematics(CLI::App& program, RunConfig& config);

}  // namespace unflex::app
