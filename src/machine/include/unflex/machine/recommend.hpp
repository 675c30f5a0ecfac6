// Settings that are allowed but not wise.
#pragma once

#include <string>
#include <vector>

#include "unflex/machine/machine.hpp"

namespace unflex::machine {

// One line for each setting that could be better, with a better value. The lines are to be shown as
// warnings.
[[nodiscard]] std::vector<std::string> recommendations(const Settings& settings);

}  // namespace unflex::machine
