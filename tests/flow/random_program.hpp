// Random valid programs: what slicers, users and scripts write between moves, in any order and at
// any speed.
#pragma once

#include <random>
#include <string>
#include <vector>

#include "unflex/gcode/interpreter.hpp"

namespace unflex::flow::testing {

struct RandomProgram {
  std::vector<std::string> overrides;  // "key=value" settings of the printer
  std::string text;
};

// The seed determines the program.
[[nodiscard]] RandomProgram random_program(Firmware firmware, unsigned seed);

}  // namespace unflex::flow::testing
