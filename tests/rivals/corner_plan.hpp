// The plan of (0,0) → (10,0) → (10,10) with a full stop at the corner.
#pragma once

#include <vector>

#include "unflex/planner/klipper_planner.hpp"

namespace unflex::rivals::testing {

inline std::vector<planner::PlannedMove> corner_plan(double velocity, double accel,
                                                     double corner_velocity = 0.0) {
  planner::KlipperPlanner planner({velocity, accel, corner_velocity, 0.0}, {});
  gcode::Segment segment;
  segment.feed_mm_s = velocity;
  segment.end_mm = {10.0, 0.0, 0.0, 0.3};
  planner.add(segment);
  segment.start_mm = segment.end_mm;
  segment.end_mm = {10.0, 10.0, 0.0, 0.6};
  planner.add(segment);
  planner.stop();
  std::vector<planner::PlannedMove> moves;
  planner.take(moves);
  return moves;
}

}  // namespace unflex::rivals::testing
