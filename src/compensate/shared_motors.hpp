// Two axes that are moved by the same motors, each of which does as much as both axes together.
#pragma once

#include "unflex/compensate/run.hpp"

namespace unflex::compensate {

// Solves both axes of a window so that |ẋ| + |ẏ| ≤ V and |ẍ| + |ÿ| ≤ A at the nodes: as for axes
// with motors of their own, and where that asks too much of a motor, with its limits divided
// between them node by node. The window gets the limits that its solution was found under.
[[nodiscard]] AxisSolutions solve_with_shared_motors(const Engine& engine, RunWindow& window);

}  // namespace unflex::compensate
