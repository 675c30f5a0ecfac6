// Solves the three modes of a window whose motors move several of them.
#pragma once

#include "unflex/compensate/run.hpp"

namespace unflex::compensate {

[[nodiscard]] AxisSolutions solve_modes(const Engine& engine, RunWindow& window);

}  // namespace unflex::compensate
