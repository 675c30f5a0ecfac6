#include "unflex/timing/stretched.hpp"

namespace unflex::timing {

std::vector<planner::PlannedMove> stretched(std::span<const planner::PlannedMove> plan,
                                            double factor) {
  std::vector<planner::PlannedMove> result(plan.begin(), plan.end());
  for (planner::PlannedMove& move : result) {
    for (double* const time_s : {&move.lead_s, &move.accel_s, &move.cruise_s, &move.decel_s}) {
      *time_s *= factor;
    }
    for (double* const speed_mm_s :
         {&move.start_v_mm_s, &move.leap_mm_s, &move.cruise_v_mm_s, &move.end_v_mm_s}) {
      *speed_mm_s /= factor;
    }
    move.accel_mm_s2 /= factor * factor;
  }
  return result;
}

}  // namespace unflex::timing
