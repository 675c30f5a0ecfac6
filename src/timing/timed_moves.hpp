// The moves of a path in the timing of a nozzle that has been found to pass along it.
#pragma once

#include <span>
#include <vector>

#include "unflex/planner/planner.hpp"
#include "unflex/timing/timing.hpp"

namespace unflex::timing {

// A time, and how far the nozzle has come along the path by then, in X and Y alone.
struct Progress {
  double time_s = 0.0;
  double path_mm = 0.0;
  double speed_mm_s = 0.0;
};

// The moves in pieces. progress: from the path's beginning to its end, always further.
[[nodiscard]] Timed timed_moves(std::span<const planner::PlannedMove> path,
                                std::span<const MoveBounds> bounds,
                                std::span<const Progress> progress);

}  // namespace unflex::timing
