// Two axes that are moved by the same motors. Each motor does as much as both axes together.
#pragma once

#include "unflex/compensate/run.hpp"

namespace unflex::compensate {

// Solves both axes of a window so that |ẋ| + |ẏ| ≤ V and |ẍ| + |ÿ| ≤ A at the nodes. At first each
// axis is solved as if it had motors of its own. If that asks too much of a motor, its limits are
// divided between the axes, node by node. The window gets the limits that its solution was found
// under.
[[nodiscard]] AxisSolutions solve_with_shared_motors(const Engine& engine, RunWindow& window);

}  // namespace unflex::compensate
