// The hotend's temperature along a print, and changes of it asked for ahead.
#pragma once

#include <optional>

#include "unflex/core/error.hpp"
#include "unflex/core/progress.hpp"
#include "unflex/flow/flow.hpp"
#include "unflex/hotend/plant.hpp"
#include "unflex/machine/machine.hpp"
#include "unflex/report/report.hpp"

namespace unflex::temperature {

// The hotend of the settings, if they have a model.
[[nodiscard]] std::optional<hotend::Plant> hotend_plant(const machine::HotendSettings& settings);

// Whether the output may change.
enum class OutputMay {
  stay,    // it is only looked at
  change,  // changes of temperature may be put ahead
};

// Simulates the hotend along input and output and tells of it in the report, if there is a model.
// Changes of temperature are put ahead in the output if hotend.ahead and `may` say so. Then the
// numbers of the output's lines in the report follow. Fails if a file cannot be read or written,
// and if the user has cancelled.
[[nodiscard]] Status follow_temperature(const flow::Job& job, OutputMay may, Progress& progress,
                                        report::Report& report);

}  // namespace unflex::temperature
