// The firmwares unflex knows.
#pragma once

#include <string_view>

namespace unflex {

enum class Firmware { klipper, marlin, rrf };

// As the configuration spells it: "klipper", "marlin", "rrf".
[[nodiscard]] std::string_view to_string(Firmware firmware);

}  // namespace unflex
