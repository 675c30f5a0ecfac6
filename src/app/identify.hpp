// `unflex identify`: from records to frequency and damping.
#pragma once

#include "unflex/app/run_config.hpp"
#include "unflex/core/error.hpp"

namespace unflex::app {

[[nodiscard]] Result<ExitCode> run_identify(const RunConfig& config);

}  // namespace unflex::app
