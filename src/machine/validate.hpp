// What no single key can be checked for.
#pragma once

#include "draft.hpp"

namespace unflex::machine {

// Nodes per period of resonance that leave little to be gained by more.
inline constexpr double kGoodNodesPerPeriod = 20.0;

// Turns mass, stiffness and damping into frequency and damping ratio.
[[nodiscard]] Status resolve_dynamics(Draft& draft);

// Checks keys against each other.
[[nodiscard]] Status check_consistency(const Draft& draft);

}  // namespace unflex::machine
