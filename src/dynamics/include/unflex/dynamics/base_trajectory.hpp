// The motion of the base over a run, sampled at equally spaced nodes.
#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>
#include <vector>

#include "unflex/core/axes.hpp"
#include "unflex/core/xy.hpp"

namespace unflex::dynamics {

// One axis at the nodes. b̈ is linear between nodes, so b is a cubic there.
struct AxisTrajectory {
  std::vector<double> position_mm;
  std::vector<double> velocity_mm_s;
  std::vector<double> accel_mm_s2;
};

// b, ḃ, b̈ at one moment.
struct AxisMotion {
  double position_mm = 0.0;
  double velocity_mm_s = 0.0;
  double accel_mm_s2 = 0.0;
};

// The motion `s` seconds after node k, between nodes k and k+1, which are h seconds apart; k + 1 <
// number of nodes.
[[nodiscard]] inline AxisMotion between(const AxisTrajectory& axis, std::size_t k, double s,
                                        double h) {
  const double a0 = axis.accel_mm_s2[k];
  const double jerk = (axis.accel_mm_s2[k + 1] - a0) / h;
  return {axis.position_mm[k] + s * (axis.velocity_mm_s[k] + s * (0.5 * a0 + s * jerk / 6.0)),
          axis.velocity_mm_s[k] + s * (a0 + 0.5 * s * jerk), a0 + s * jerk};
}

struct BaseTrajectory : Axes<AxisTrajectory> {
  double period_s = 0.0;  // h
  // How far the base is above the plan, where it makes up for modes that move the nozzle in Z.
  std::optional<AxisTrajectory> above = {};

  [[nodiscard]] std::size_t nodes() const { return x.position_mm.size(); }
  [[nodiscard]] double duration_s() const { return static_cast<double>(nodes() - 1) * period_s; }
  [[nodiscard]] XY node_mm(std::size_t k) const {
    return map_axes([&](const AxisTrajectory& axis) { return axis.position_mm[k]; }, *this);
  }
  // t is clamped to [0, duration_s()].
  [[nodiscard]] Axes<AxisMotion> at(double t) const {
    return map_axes([&](const AxisTrajectory& axis) { return at(axis, t); }, *this);
  }
  [[nodiscard]] XY position_mm(double t) const {
    return map_axes([](const AxisMotion& motion) { return motion.position_mm; }, at(t));
  }
  [[nodiscard]] XY velocity_mm_s(double t) const {
    return map_axes([](const AxisMotion& motion) { return motion.velocity_mm_s; }, at(t));
  }
  // One of the axes alone.
  [[nodiscard]] AxisMotion at(const AxisTrajectory& axis, double t) const {
    const double clamped = std::clamp(t, 0.0, duration_s());
    const auto k = std::min(static_cast<std::size_t>(clamped / period_s), nodes() - 2);
    return between(axis, k, clamped - static_cast<double>(k) * period_s, period_s);
  }
};

}  // namespace unflex::dynamics
