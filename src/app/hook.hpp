// unflex as a slicer's post-processing script: what the slicer tells by its environment.
#pragma once

#include <optional>
#include <string>

#include "unflex/app/run_config.hpp"
#include "unflex/core/error.hpp"
#include "unflex/machine/print_text.hpp"

namespace unflex::app {

// What PrusaSlicer and its relatives set for their scripts: every setting as SLIC3R_<KEY>, spelt as
// in the settings block of the G-code, and beside these
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

// What was asked for, completed by what a slicer that has started the program says: `compensate
// --in-place` takes the slicer's settings, calls the print by its final name, and a report that is
// only a suffix (".html") stands beside the final file. Other commands do not look at the slicer.
// An error of kind usage if there is no such place.
[[nodiscard]] Result<RunConfig> with_slicer(RunConfig config, const Slicer& slicer);

}  // namespace unflex::app
