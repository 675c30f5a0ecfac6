// The settings as each stage wants them.
#pragma once

#include <string>
#include <vector>

#include "unflex/compensate/run.hpp"
#include "unflex/emit/emit_options.hpp"
#include "unflex/gcode/interpreter.hpp"
#include "unflex/machine/machine.hpp"
#include "unflex/planner/planner.hpp"
#include "unflex/verify/verify.hpp"

namespace unflex::pipeline {

[[nodiscard]] gcode::InterpreterOptions interpreter_options(const machine::Settings& settings);
[[nodiscard]] planner::Limits planner_limits(const machine::Settings& settings);
[[nodiscard]] planner::FirmwareConfig firmware_config(const machine::Settings& settings);
[[nodiscard]] compensate::Setup compensate_setup(const machine::Settings& settings);
// The setup for one run. If the travel of an axis is not known, the base stays above 0 if the run
// does, since many machines end there.
[[nodiscard]] compensate::Setup setup_for(const compensate::Setup& setup,
                                          const std::vector<planner::PlannedMove>& run,
                                          const machine::Settings& settings);
[[nodiscard]] emit::EmitOptions emit_options(const machine::Settings& settings,
                                             std::string version);
[[nodiscard]] verify::Rules verify_rules(const machine::Settings& settings);

}  // namespace unflex::pipeline
