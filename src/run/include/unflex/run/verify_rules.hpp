// The settings as the verifier wants them.
#pragma once

#include "unflex/machine/machine.hpp"
#include "unflex/verify/verify.hpp"

namespace unflex::run {

[[nodiscard]] verify::StepRules step_rules(const machine::Settings& settings);
[[nodiscard]] verify::Rules verify_rules(const machine::Settings& settings);

}  // namespace unflex::run
