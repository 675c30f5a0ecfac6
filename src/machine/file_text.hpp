// Small files as text.
#pragma once

#include <string>

#include "unflex/core/error.hpp"

namespace unflex::machine {

// The whole file. Errors are of kind usage; a file that is too large for a printer file is one.
[[nodiscard]] Result<std::string> read_printer_file(const std::string& file);

}  // namespace unflex::machine
