// A Klipper printer's configuration as settings.
#pragma once

#include <string>
#include <string_view>

#include "assign.hpp"

namespace unflex::machine {

// Reads printer.cfg with what it includes; `file` is where it is. The result also says that a
// printer without [input_shaper] or [firmware_retraction] has none, and it has Klipper's own
// defaults. If an include is missing, a section that is not found may stand in it, so the result
// says neither. Messages about missing settings then name the include.
[[nodiscard]] Result<Reading> read_klipper(std::string_view text, const std::string& file);

}  // namespace unflex::machine
