// G-code that makes a printer show how many lines per second it takes.
#pragma once

#include <string>
#include <vector>

#include "unflex/core/error.hpp"
#include "unflex/machine/machine.hpp"

namespace unflex::machine {

// A stage of the test: lines of one length at one speed, lines_per_s of them per second of motion.
struct LineTestStage {
  double lines_per_s = 0.0;
  double speed_mm_s = 0.0;
  double duration_s = 0.0;  // as the firmware plans it, ramps included
};

// The stages that the firmware can be asked for: the lines are long enough that it does not join
// them, and the lines that it plans ahead are together long enough to brake in.
[[nodiscard]] std::vector<LineTestStage> line_test_stages(const Settings& settings);

// The file: homing, then one stage after the other, each a layer of its own, higher and further
// along Y, without heat or filament. An error of kind usage if the travel or the limits are too
// small.
[[nodiscard]] Result<std::string> line_test(const Settings& settings);

}  // namespace unflex::machine
