// Settings written as the firmware's own commands.
#pragma once

#include <string>
#include <string_view>

#include "assign.hpp"

namespace unflex::machine {

// What Marlin answers to M503, as a terminal shows it ("echo:  M92 X80.00 …").
[[nodiscard]] Result<Reading> read_marlin_dump(std::string_view text, const std::string& file);

// RepRapFirmware's config.g.
[[nodiscard]] Result<Reading> read_rrf_config(std::string_view text, const std::string& file);

}  // namespace unflex::machine
