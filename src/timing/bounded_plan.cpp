// Notation:
//   L, a, V   length, acceleration and largest speed of a move      v   speed at a vertex
// Backward and forward, v² changes by no more than 2aL along a move.
#include "bounded_plan.hpp"

#include <algorithm>
#include <cmath>

namespace unflex::timing {

std::vector<planner::PlannedMove> bounded_plan(std::span<const planner::PlannedMove> path,
                                               std::span<const MoveBounds> bounds,
                                               std::span<const double> vertex_speeds_mm_s) {
  const std::size_t count = path.size();
  std::vector<double> v2(count + 1);
  for (std::size_t i = 0; i <= count; ++i) {
    v2[i] = vertex_speeds_mm_s[i];
    if (i > 0) {
      v2[i] = std::min(v2[i], bounds[i - 1].speed_mm_s);
    }
    if (i < count) {
      v2[i] = std::min(v2[i], bounds[i].speed_mm_s);
    }
    v2[i] *= v2[i];
  }
  const auto most_change = [&](std::size_t i) {
    return 2.0 * bounds[i].accel_mm_s2 * path[i].length_mm;
  };
  for (std::size_t i = count; i-- > 0;) {
    v2[i] = std::min(v2[i], v2[i + 1] + most_change(i));
  }
  for (std::size_t i = 0; i < count; ++i) {
    v2[i + 1] = std::min(v2[i + 1], v2[i] + most_change(i));
  }
  std::vector<planner::PlannedMove> plan(path.begin(), path.end());
  for (std::size_t i = 0; i < count; ++i) {
    planner::PlannedMove& move = plan[i];
    const double a = bounds[i].accel_mm_s2;
    const double top2 = std::min(bounds[i].speed_mm_s * bounds[i].speed_mm_s,
                                 0.5 * (v2[i] + v2[i + 1] + most_change(i)));
    const double cruise2 = std::max({top2, v2[i], v2[i + 1]});
    move.start_v_mm_s = std::sqrt(v2[i]);
    move.cruise_v_mm_s = std::sqrt(cruise2);
    move.end_v_mm_s = std::sqrt(v2[i + 1]);
    move.accel_mm_s2 = a;
    move.lead_s = move.leap_mm_s = 0.0;
    move.accel_s = (move.cruise_v_mm_s - move.start_v_mm_s) / a;
    move.decel_s = (move.cruise_v_mm_s - move.end_v_mm_s) / a;
    const double ramps_mm = 0.5 * (move.accel_s * (move.start_v_mm_s + move.cruise_v_mm_s) +
                                   move.decel_s * (move.cruise_v_mm_s + move.end_v_mm_s));
    move.cruise_s = std::max(move.length_mm - ramps_mm, 0.0) / move.cruise_v_mm_s;
  }
  return plan;
}

}  // namespace unflex::timing
