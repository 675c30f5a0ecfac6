// Compares the states in which two files leave the machine.
#pragma once

#include <string>

#include "replay.hpp"

namespace unflex::verify {

// Says in words how the sliced and the emitted file's states differ at the same place; empty if
// they do not. Positions may differ by one rounding step of coordinates. E is compared only if the
// next E word depends on it.
[[nodiscard]] std::string modal_difference(const gcode::ModalState& input,
                                           const gcode::ModalState& output);

[[nodiscard]] std::string limits_difference(const planner::Limits& input,
                                            const planner::Limits& output);

}  // namespace unflex::verify
