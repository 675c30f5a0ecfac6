// `unflex printer keys`: what there is to set.
#pragma once

#include <string>

#include "unflex/app/run_config.hpp"
#include "unflex/core/error.hpp"

namespace unflex::app {

// Every key that a printer file and --set take. A key's line begins with its name, lines that tell
// more of it begin with a space: the completions of shells read it.
[[nodiscard]] std::string keys_text();

[[nodiscard]] Result<ExitCode> run_printer_keys();

}  // namespace unflex::app
