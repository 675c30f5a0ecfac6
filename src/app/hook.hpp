// unflex as a slicer's post-processing script: the facts that the slicer gives in the environment.
#pragma once

#include <optional>
#include <string>

#include "unflex/app/run_config.hpp"
#include "unflex/core/error.hpp"
#include "unflex/machine/print_text.hpp"

namespace unflex::app {

// Variables that PrusaSlicer and its relatives set for their scripts. Every setting is
// SLIC3R_<KEY>, spelt as in the settings block of the G-code. Further variables:
//   SLIC3R_PP_HOST         "File", or the kind of print host the file is uploaded to
//   SLIC3R_PP_OUTPUT_NAME  where the file goes when the scripts are done: a path, or a name on the
//                          host. What scripts are given is a temporary file.
struct Slicer {
  std::optional<std::string> host;
  std::optional<std::string> output_name;
  machine::SlicerVariables settings;
};

// Reads the environment of the process.
[[nodiscard]] Slicer read_slicer();

// The configuration, completed by the facts of a slicer that has started the program. `compensate
// --in-place` takes the slicer's settings and calls the print by its final name. A report that is
// only a suffix (".html") stands beside the final file. Other commands ignore the slicer. An error
// of kind usage if the report has no such place.
[[nodiscard]] Result<RunConfig> with_slicer(RunConfig config, const Slicer& slicer);

}  // namespace unflex::app
