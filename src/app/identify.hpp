// `unflex identify`: from records to the modes of the axes.
#pragma once

#include "console.hpp"
#include "identification.hpp"
#include "unflex/app/run_config.hpp"
#include "unflex/core/error.hpp"

namespace unflex::app {

// Reads and fits all records, and combines those of an axis. Errors are of kind input: a file that
// cannot be read, that is no record, or in which nothing moved.
[[nodiscard]] Result<Identification> identify_records(const IdentifyConfig& config);

[[nodiscard]] Result<ExitCode> run_identify(const RunConfig& config, Console& console);

}  // namespace unflex::app
