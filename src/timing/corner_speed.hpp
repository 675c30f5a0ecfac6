#pragma once

#include "unflex/planner/planner.hpp"

namespace unflex::timing {

// The speed at which a corner is passed at this acceleration on a circle that strays from it by the
// tolerance, and on the circle that touches the shorter move in its middle (as in
// klippy/toolhead.py, calc_junction). No limit if the path goes straight on.
[[nodiscard]] double corner_speed_mm_s(const planner::PlannedMove& before,
                                       const planner::PlannedMove& after, double accel_mm_s2,
                                       double tolerance_mm);

}  // namespace unflex::timing
