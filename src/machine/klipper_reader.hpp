// What a Klipper printer's configuration says, as settings.
#pragma once

#include <string>
#include <string_view>

#include "assign.hpp"

namespace unflex::machine {

// Reads printer.cfg with what it includes; `file` is where it is. The result also says that a
// printer without [input_shaper] or [firmware_retraction] has none, and it has Klipper's own
// defaults. Where an include is missing, neither is said of a printer whose section is not there.
// A message names it where something needed may stand in it.
[[nodiscard]] Result<Reading> read_klipper(std::string_view text, const std::string& file);

}  // namespace unflex::machine
