#include "unflex/dynamics/base_trajectory.hpp"

#include <algorithm>

namespace unflex::dynamics {

AxisMotion between(const AxisTrajectory& axis, std::size_t k, double s, double h) {
  const double a0 = axis.accel_mm_s2[k];
  const double jerk = (axis.accel_mm_s2[k + 1] - a0) / h;
  return {axis.position_mm[k] + s * (axis.velocity_mm_s[k] + s * (0.5 * a0 + s * jerk / 6.0)),
          axis.velocity_mm_s[k] + s * (a0 + 0.5 * s * jerk), a0 + s * jerk};
}

AxisMotion BaseTrajectory::at(const AxisTrajectory& axis, double t) const {
  const double clamped = std::clamp(t, 0.0, duration_s());
  const auto k = std::min(static_cast<std::size_t>(clamped / period_s), nodes() - 2);
  return between(axis, k, clamped - static_cast<double>(k) * period_s, period_s);
}

}  // namespace unflex::dynamics
