// The nozzle from node to node of a base whose acceleration is linear between nodes, exactly.
//
// Notation:
//   g, τ   gain and lead of a mode      a, j   the base's acceleration at a node, and its slope
//   y      q − g b − τ ḃ, of which ÿ + 2ζωẏ + ω²y = F + F' t, with F' = −(g + 2ζωτ) j and
//          F = −(g + 2ζωτ) a − τ j
#pragma once

#include <array>
#include <cstddef>

#include "unflex/dynamics/base_trajectory.hpp"
#include "unflex/dynamics/flexible_axis.hpp"

namespace unflex::dynamics {

class NodeMap {
 public:
  // period_s: between nodes.
  NodeMap(const FlexibleAxis& axis, double period_s);

  // Advances the nozzle from node k to the next. A base that is joined from parts may jump at the
  // next node. The nozzle does not jump with it.
  void advance(const AxisTrajectory& base, std::size_t k, NozzleState& state) const {
    const double v = base.velocity_mm_s[k];
    const double a = base.accel_mm_s2[k];
    const AxisMotion end = between(base, k, period_s_, period_s_);
    const double j = (base.accel_mm_s2[k + 1] - a) / period_s_;
    for (std::size_t i = 0; i < count_; ++i) {
      const OfMode& map = maps_[i];
      NozzleMotion& part = state.parts[i];
      const double y = part.position - map.gain * base.position_mm[k] - map.lead_s * v;
      const double rate = part.velocity - map.gain * v - map.lead_s * a;
      const double slope = -map.push * j;
      const double force = -map.push * a - map.lead_s * j;
      part = {map.gain * end.position_mm + map.lead_s * end.velocity_mm_s +
                  (map.of_place.position * y + map.of_rate.position * rate) +
                  (map.of_force.position * force + map.of_slope.position * slope),
              map.gain * end.velocity_mm_s + map.lead_s * end.accel_mm_s2 +
                  (map.of_place.velocity * y + map.of_rate.velocity * rate) +
                  (map.of_force.velocity * force + map.of_slope.velocity * slope)};
    }
  }

 private:
  // y and its rate after one period, per unit of each quantity.
  struct OfMode {
    double gain = 1.0;
    double lead_s = 0.0;
    double push = 1.0;  // g + 2ζωτ
    NozzleMotion of_place;
    NozzleMotion of_rate;
    NozzleMotion of_force;  // F
    NozzleMotion of_slope;  // F'
  };
  double period_s_ = 0.0;
  std::array<OfMode, kMostModes> maps_;
  std::size_t count_ = 0;
};

}  // namespace unflex::dynamics
