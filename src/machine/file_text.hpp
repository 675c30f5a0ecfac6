// Small files as text.
#pragma once

#include <filesystem>
#include <string>

#include "unflex/core/error.hpp"

namespace unflex::machine {

// The whole file; errors, of kind usage, also where it is too large for a printer file.
[[nodiscard]] Result<std::string> read_printer_file(const std::filesystem::path& file);

}  // namespace unflex::machine
