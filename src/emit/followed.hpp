// The nozzle that follows the base exactly. We compare the nozzle that follows the lines with it.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <type_traits>
#include <vector>

#include "unflex/dynamics/base_trajectory.hpp"
#include "unflex/dynamics/flexible_axis.hpp"

namespace unflex::emit {

// States of a nozzle of kModes modes as vectors: (q_1, q̇_1, …).
template <int kModes>
using ModesVector = Eigen::Matrix<double, 2 * kModes, 1>;

template <int kModes>
[[nodiscard]] ModesVector<kModes> vector_of(const dynamics::NozzleState& state) {
  ModesVector<kModes> result;
  for (Eigen::Index i = 0; i < kModes; ++i) {
    const dynamics::NozzleMotion& part = state.parts[static_cast<std::size_t>(i)];
    result.template segment<2>(2 * i) << part.position, part.velocity;
  }
  return result;
}

// The nozzle's position: the sum over the modes.
template <class Derived>
[[nodiscard]] double position_of(const Eigen::MatrixBase<Derived>& state) {
  double sum = state[0];
  for (Eigen::Index i = 2; i < state.size(); i += 2) {
    sum += state[i];
  }
  return sum;
}

// dynamics::exact_step() of one mode for one step length, as a matrix: the step is linear in the
// state and in the base. States are (q, q̇). A mode that the axis does not have stays at 0.
class StepMatrix {
 public:
  StepMatrix(const dynamics::FlexibleAxis& axis, std::size_t mode, double dt);

  [[nodiscard]] double dt() const { return dt_; }
  [[nodiscard]] double gain() const { return gain_; }
  [[nodiscard]] Eigen::Matrix2d free() const { return columns_.leftCols<2>(); }
  // The effect of a base of even velocity in a step.
  [[nodiscard]] Eigen::Vector2d base(double position, double velocity) const {
    return columns_.col(2) * position + columns_.col(3) * velocity;
  }

 private:
  double dt_;
  double gain_ = 0.0;
  Eigen::Matrix<double, 2, 4> columns_ = Eigen::Matrix<double, 2, 4>::Zero();
};

// The state of the nozzle that follows one axis of the base. It starts along with the base, or with
// a given state.
class Followed {
 public:
  // axis: its number in Axes.
  Followed(const dynamics::BaseTrajectory& base, std::size_t axis,
           const dynamics::FlexibleAxis& nozzle);
  Followed(const dynamics::BaseTrajectory& base, std::size_t axis,
           const dynamics::FlexibleAxis& nozzle, const dynamics::NozzleState& start);

  [[nodiscard]] dynamics::NozzleState at(double t) const;

 private:
  void note(const dynamics::NozzleState& state);

  std::size_t modes_;
  std::vector<dynamics::NozzleMotion> parts_;  // of each mode, at the base's nodes
  double period_s_;
};

// Calls use(std::integral_constant<int, n>) for n modes, so that sizes are known to the compiler.
template <class Use>
[[nodiscard]] auto with_modes(std::size_t modes, Use use) {
  static_assert(dynamics::kMostModes == 3);
  return modes == 1   ? use(std::integral_constant<int, 1>{})
         : modes == 2 ? use(std::integral_constant<int, 2>{})
                      : use(std::integral_constant<int, 3>{});
}

// Weight of the polygon's distance from the base, relative to the nozzle's error. With this weight,
// motion above about six times the resonance follows the base rather than the nozzle.
inline constexpr double kBaseWeight = 1e-3;

// ∫ p² = zᵀ P z of a nozzle that rings down around a base at rest in 0, z = (q_1, q̇_1, …), from the
// closed form (Lyapunov's equation). Damping ratios below 0.01 are taken as 0.01, so that the
// integral is finite. kModes may be more than the axis has.
template <int kModes>
using ModesSquare = Eigen::Matrix<double, 2 * kModes, 2 * kModes>;
template <int kModes>
[[nodiscard]] ModesSquare<kModes> ring_down_square(const dynamics::FlexibleAxis& axis);

}  // namespace unflex::emit
