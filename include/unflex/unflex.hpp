// All of the library in one include: read settings, compensate a print, tell what came of it.
//
//   unflex::machine::Settings settings;
//   settings.dynamics_x.freq_hz = 45.0;
//   settings.dynamics_y.freq_hz = 38.0;
//   std::ifstream sliced("in.gcode");
//   std::ofstream output("out.gcode");
//   const auto report = unflex::flow::compensate(sliced, output, settings);
#pragma once

#include <istream>
#include <ostream>

#include "unflex/core/error.hpp"
#include "unflex/core/firmware.hpp"
#include "unflex/core/progress.hpp"
#include "unflex/core/text_store.hpp"
#include "unflex/flow/flow.hpp"
#include "unflex/machine/machine.hpp"
#include "unflex/machine/print_text.hpp"
#include "unflex/platform/files.hpp"
#include "unflex/report/report.hpp"

namespace unflex::flow {

// Compensates the sliced print and writes it, as compensate() does with a job of one worker.
// Both texts are held in memory meanwhile, and nothing is written unless all went well. Errors: the
// settings are not valid (Settings::validate()); those of compensate(); a stream cannot be
// read or written. Only a report with violation_count 0 says that the output may be printed.
[[nodiscard]] Result<report::Report> compensate(std::istream& sliced, std::ostream& output,
                                                const machine::Settings& settings);

}  // namespace unflex::flow
