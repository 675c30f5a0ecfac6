// `unflex printer keys`: the list of all settings.
#pragma once

#include <string>

#include "unflex/app/run_config.hpp"
#include "unflex/core/error.hpp"

namespace unflex::app {

// Every key that a printer file and --set take. A key's line begins with its name. Further lines
// about the key begin with a space. The completions of shells read this text.
[[nodiscard]] std::string keys_text();

[[nodiscard]] Result<ExitCode> run_printer_keys();

}  // namespace unflex::app
