// The output of `unflex inspect`, for people and for programs.
#pragma once

#include <string>
#include <vector>

#include "unflex/flow/flow.hpp"
#include "unflex/machine/machine.hpp"
#include "unflex/report/report.hpp"

namespace unflex::app {

// all_settings: those at their default, too.
[[nodiscard]] std::string inspection_text(const flow::Inspection& inspection,
                                          const std::string& input,
                                          const machine::Settings& settings, bool all_settings);

// The keys are those of docs/report.md.
[[nodiscard]] std::string inspection_json(const flow::Inspection& inspection,
                                          const std::string& input,
                                          const machine::Settings& settings);

[[nodiscard]] std::vector<report::Setting> settings_in_force(const machine::Settings& settings);

}  // namespace unflex::app
