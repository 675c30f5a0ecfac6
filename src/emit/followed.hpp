// The nozzle that follows the base exactly. We compare the nozzle that follows the lines with it.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "unflex/dynamics/base_trajectory.hpp"
#include "unflex/dynamics/flexible_axis.hpp"

namespace unflex::emit {

// BaseTrajectory::x_at or y_at.
using AxisAt = dynamics::AxisMotion (dynamics::BaseTrajectory::*)(double) const;

// dynamics::exact_step() for one step length, as a matrix: the step is linear in the state and in
// the base. States are (p, ṗ).
class StepMatrix {
 public:
  StepMatrix(const dynamics::FlexibleAxis& axis, double dt);

  [[nodiscard]] double dt() const { return dt_; }
  [[nodiscard]] Eigen::Matrix2d free() const { return columns_.leftCols<2>(); }
  [[nodiscard]] Eigen::Vector2d base(double position, double velocity, double accel = 0.0) const {
    return columns_.col(2) * position + columns_.col(3) * velocity + columns_.col(4) * accel;
  }

 private:
  double dt_;
  Eigen::Matrix<double, 2, 5> columns_;
};

// (p, ṗ) of the nozzle that follows one axis of the base. It starts with the base's position and
// velocity, or with a given state.
class Followed {
 public:
  Followed(const dynamics::BaseTrajectory& base, AxisAt axis, const dynamics::FlexibleAxis& nozzle);
  Followed(const dynamics::BaseTrajectory& base, AxisAt axis, const dynamics::FlexibleAxis& nozzle,
           const std::array<double, 2>& start);

  [[nodiscard]] Eigen::Vector2d at(double t) const;

 private:
  std::vector<std::array<double, 2>> states_;  // at the base's nodes
  double period_s_;
};

// Weight of the polygon's own distance from the base, against the nozzle's error. So motion above
// about six times the resonance follows the base rather than the nozzle.
inline constexpr double kBaseWeight = 1e-3;

// ∫ e² = (e, ė) P (e, ė)ᵀ of a nozzle that rings down around a base at rest, from the closed form
// (Lyapunov's equation). Damping ratios below 0.01 are taken as 0.01, so that the integral is
// finite.
[[nodiscard]] Eigen::Matrix2d ring_down_square(const dynamics::FlexibleAxis& axis);

}  // namespace unflex::emit
