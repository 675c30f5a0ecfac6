// The macros by which Klipper pauses where a compensated run has ended.
#pragma once

#include <string>

namespace unflex::app {

// What printer.cfg includes.
[[nodiscard]] std::string klipper_macros();

}  // namespace unflex::app
