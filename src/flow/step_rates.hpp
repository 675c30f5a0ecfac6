// Step rates from the judge to the report.
#pragma once

#include <string>
#include <vector>

#include "unflex/machine/machine.hpp"
#include "unflex/report/report.hpp"
#include "unflex/verify/step_rates.hpp"

namespace unflex::flow {

// Puts the rates into rows, the limits stay as they are. emitted: nullptr if there is no output.
void add_step_rates(const verify::StepRates& sliced, const verify::StepRates* emitted,
                    report::StepRates& rates);

// Puts the limits of the settings into the report.
void add_step_limits(const machine::Settings& settings, report::StepRates& rates);

// Tells of the sliced file's lines that ask more of the motors than the limits allow.
void warn_of_sliced_steps(const std::vector<verify::StepBreach>& breaches, const std::string& input,
                          std::vector<std::string>& warnings);

}  // namespace unflex::flow
