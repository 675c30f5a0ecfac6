// A motion m behind an input shaper: Σ A_i m(t − t_i), with the pulses' weights A_i and times t_i.
// Without pulses the motion stays as it is.
#pragma once

#include <cstddef>
#include <span>

#include "unflex/dynamics/base_trajectory.hpp"
#include "unflex/dynamics/flexible_axis.hpp"
#include "unflex/dynamics/shapers.hpp"

namespace unflex::dynamics {

// Adds `times` the other motion.
inline void add(AxisMotion& sum, const AxisMotion& other, double times) {
  sum.position_mm += times * other.position_mm;
  sum.velocity_mm_s += times * other.velocity_mm_s;
  sum.accel_mm_s2 += times * other.accel_mm_s2;
}
inline void add(BaseSegment& sum, const BaseSegment& other, double times) {
  sum.position += times * other.position;
  sum.velocity += times * other.velocity;
  sum.acceleration += times * other.acceleration;
}
inline void add(NozzleMotion& sum, const NozzleMotion& other, double times) {
  sum.position += times * other.position;
  sum.velocity += times * other.velocity;
}
inline void add(NozzleState& sum, const NozzleState& other, double times) { sum.add(other, times); }

// The shaped motion at time t, added to `sum`. at(i, t) returns the motion at time t for the i-th
// pulse. Without pulses i is 0.
template <typename Motion, typename At>
[[nodiscard]] Motion shaped_at(std::span<const Pulse> pulses, double t, At&& at, Motion sum = {}) {
  if (pulses.empty()) {
    add(sum, at(0, t), 1.0);
  }
  for (std::size_t i = 0; i < pulses.size(); ++i) {
    add(sum, at(i, t - pulses[i].time_s), pulses[i].weight);
  }
  return sum;
}

}  // namespace unflex::dynamics
