// Marlin's settings as it lists them.
#pragma once

#include <string>
#include <string_view>

#include "assign.hpp"

namespace unflex::machine {

// Reads Marlin's answer to M503, as a terminal shows it ("echo:  M92 X80.00 …"), in the words of
// Marlin 1.1 and later or of Marlin 1.0. Errors, of kind usage: a delta or a SCARA.
[[nodiscard]] Result<Reading> read_marlin_dump(std::string_view text, const std::string& file);

}  // namespace unflex::machine
