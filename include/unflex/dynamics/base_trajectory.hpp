// The motion of the base over a run, sampled at equally spaced nodes.
#pragma once

#include <cstddef>
#include <vector>

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
[[nodiscard]] AxisMotion between(const AxisTrajectory& axis, std::size_t k, double s, double h);

struct BaseTrajectory {
  double period_s = 0.0;  // h
  AxisTrajectory x;
  AxisTrajectory y;

  [[nodiscard]] std::size_t nodes() const { return x.position_mm.size(); }
  [[nodiscard]] double duration_s() const { return static_cast<double>(nodes() - 1) * period_s; }
  // t is clamped to [0, duration_s()].
  [[nodiscard]] AxisMotion x_at(double t) const { return at(x, t); }
  [[nodiscard]] AxisMotion y_at(double t) const { return at(y, t); }

 private:
  [[nodiscard]] AxisMotion at(const AxisTrajectory& axis, double t) const;
};

}  // namespace unflex::dynamics
