// Checks that concern more than one key.
#pragma once

#include "draft.hpp"

namespace unflex::machine {

// Nodes per period of resonance beyond which more would gain little.
inline constexpr double kGoodNodesPerPeriod = 20.0;

// Turns mass, stiffness and damping into frequency and damping ratio.
[[nodiscard]] Status resolve_dynamics(Draft& draft);

// Checks the motors, and the maps of frequencies.
[[nodiscard]] Status check_machine(const Draft& draft);

// Checks keys against each other.
[[nodiscard]] Status check_consistency(const Draft& draft);

}  // namespace unflex::machine
