// Valid programs by chance: what slicers, their users and their scripts put between moves, in any
// order and at any speed.
#pragma once

#include <random>
#include <string>
#include <vector>

#include "unflex/gcode/interpreter.hpp"

namespace unflex::pipeline::testing {

struct RandomProgram {
  std::vector<std::string> overrides;  // "key=value", of the printer
  std::string text;
};

// The same for the same seed.
[[nodiscard]] RandomProgram random_program(Firmware firmware, unsigned seed);

}  // namespace unflex::pipeline::testing
