// Checks that concern more than one key.
#pragma once

#include <string_view>

#include "draft.hpp"

namespace unflex::machine {

// Nodes per period of resonance beyond which more would gain little.
inline constexpr double kGoodNodesPerPeriod = 20.0;

// Whether the key tells how an axis swings by itself. Where masses swing, these follow from them.
[[nodiscard]] bool is_of_axes(std::string_view key);

// Turns masses on the drives of motors into the modes of each axis, where the settings have them.
[[nodiscard]] Status resolve_masses(Draft& draft);

// Turns mass, stiffness and damping into frequency and damping ratio.
[[nodiscard]] Status resolve_dynamics(Draft& draft);

// Checks the motors, and the maps of frequencies.
[[nodiscard]] Status check_machine(const Draft& draft);

// Checks keys against each other.
[[nodiscard]] Status check_consistency(const Draft& draft);

}  // namespace unflex::machine
