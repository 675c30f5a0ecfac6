// The macros by which Klipper pauses where a compensated run has ended.
#pragma once

#include <string>

namespace unflex::app {

// The text of the file that printer.cfg is to include.
[[nodiscard]] std::string klipper_macros();

}  // namespace unflex::app
