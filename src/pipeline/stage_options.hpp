// The settings as each stage wants them.
#pragma once

#include <string>

#include "unflex/compensate/run.hpp"
#include "unflex/emit/emitter.hpp"
#include "unflex/gcode/interpreter.hpp"
#include "unflex/machine/machine.hpp"
#include "unflex/planner/planner.hpp"
#include "unflex/verify/verify.hpp"

namespace unflex::pipeline {

[[nodiscard]] gcode::InterpreterOptions interpreter_options(const machine::Settings& settings);
[[nodiscard]] planner::Limits planner_limits(const machine::Settings& settings);
[[nodiscard]] planner::FixedLimits fixed_limits(const machine::Settings& settings);
[[nodiscard]] compensate::Setup compensate_setup(const machine::Settings& settings);
[[nodiscard]] emit::EmitOptions emit_options(const machine::Settings& settings,
                                             std::string version);
[[nodiscard]] verify::Rules verify_rules(const machine::Settings& settings);

}  // namespace unflex::pipeline
