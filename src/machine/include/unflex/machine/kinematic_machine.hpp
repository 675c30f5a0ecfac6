// The settings as a machine that tells what its joints do.
#pragma once

#include "unflex/kinematics/machine.hpp"
#include "unflex/machine/machine.hpp"

namespace unflex::machine {

// Linear by Settings::motors(), with the legs of a tripteron where the settings have them.
[[nodiscard]] kinematics::Machine kinematic_machine(const Settings& settings);

}  // namespace unflex::machine
