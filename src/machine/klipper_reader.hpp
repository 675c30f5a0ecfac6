// What a Klipper printer's configuration says, as settings.
#pragma once

#include <string>
#include <string_view>

#include "assign.hpp"

namespace unflex::machine {

// Reads printer.cfg with what it includes; `file` is where it is. The result also says that a
// printer without [input_shaper] or [firmware_retraction] has none, and it has Klipper's own
// defaults.
[[nodiscard]] Result<Reading> read_klipper(std::string_view text, const std::string& file);

}  // namespace unflex::machine
