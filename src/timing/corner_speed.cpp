#include "corner_speed.hpp"

#include <algorithm>
#include <cmath>

#include "unflex/core/xy.hpp"

namespace unflex::timing {

double corner_speed_mm_s(const planner::PlannedMove& before, const planner::PlannedMove& after,
                         double accel_mm_s2, double tolerance_mm) {
  constexpr double kStraight = 0.999999;
  const double cosine = -dot(xy_of(before.direction), xy_of(after.direction));
  const double sine = std::sqrt(std::max(0.5 * (1.0 - cosine), 0.0));  // of half the angle
  if (sine > kStraight) {
    return planner::kNoLimit;
  }
  const double tangent = sine / std::sqrt(1.0 - sine * sine);
  const double by_tolerance = tolerance_mm * sine / (1.0 - sine);
  const double by_length = 0.5 * std::min(before.length_mm, after.length_mm) * tangent;
  return std::sqrt(accel_mm_s2 * std::min(by_tolerance, by_length));
}

}  // namespace unflex::timing
