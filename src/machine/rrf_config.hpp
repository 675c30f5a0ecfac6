// RepRapFirmware's config.g.
#pragma once

#include <string>
#include <string_view>

#include "assign.hpp"

namespace unflex::machine {

// Errors, of kind usage: a machine whose kinematics unflex does not know.
[[nodiscard]] Result<Reading> read_rrf_config(std::string_view text, const std::string& file);

}  // namespace unflex::machine
