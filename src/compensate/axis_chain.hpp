// The axis window as a chain over its nodes, in the units of AxisProblem (time in node periods,
// lengths in hundredths of a millimetre from the window's first reference point): the very program
// that collocation::transcribe makes of it, with the defects solved.
//
//   z_k = (p, ṗ, b, ḃ, b̈) at node k       j_k = b̈_{k+1} − b̈_k, jerk of interval k
//
//   z_{k+1} = Φ z_k + B j_k
//
// With ẋ = F x + G u the defect of Hargraves & Paris (eq. 8) is, d = x_{k+1} − x_k,
//
//   (I − F/2 + F²/12) d = F x_k + G u_k + (G/2 − F G/12) j_k
//
// The nozzle in the middle of an interval is the Hermite cubic's,
// p_c = (p_k + p_{k+1})/2 + (ṗ_k − ṗ_{k+1})/8, and the cost Simpson's rule over both:
//
//   Σ w_k (p_k − r_k)²/6 + w_c (p_c − r_c)² 4/6 + w_{k+1} (p_{k+1} − r_{k+1})²/6 + ρ j_k²
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "limits.hpp"
#include "unflex/compensate/axis_window.hpp"

namespace unflex::compensate {

using ChainVector = Eigen::Matrix<double, 5, 1>;
using ChainMatrix = Eigen::Matrix<double, 5, 5>;

struct AxisChain {
  enum Component : int { kNozzle = 0, kNozzleRate, kBase, kBaseRate, kBaseAccel };

  ChainMatrix growth;  // Φ − I
  ChainVector input;   // B

  // The chain of one mode whose gain is 1. omega_h: ωh.
  AxisChain(double omega_h, double zeta);
};

// The quantities that limits bound. Each has one row per node; jerk has one per interval.
enum class RowKind : int { position = 0, velocity, accel, jerk };
inline constexpr std::array<RowKind, 4> kRowKinds = {RowKind::position, RowKind::velocity,
                                                     RowKind::accel, RowKind::jerk};

// One value per row kind.
template <class T>
using PerKind = std::array<T, kRowKinds.size()>;

[[nodiscard]] constexpr std::size_t index_of(RowKind kind) {
  return static_cast<std::size_t>(kind);
}

[[nodiscard]] constexpr std::size_t row_count(RowKind kind, std::size_t nodes) {
  return kind == RowKind::jerk ? nodes - 1 : nodes;
}

// A pull on the nozzle at every node, too weak to be noticed. Where the reference rests, steps
// would otherwise ring out into denormal numbers, which take ten times as long. The forms reverse
// the pull with every step. Otherwise steps would settle to it and become as small again.
inline constexpr double kFaintPull = 1e-60;

// The window's numbers, scaled.
struct ScaledWindow {
  const AxisWindow* window = nullptr;
  std::size_t nodes = 0;
  double origin_mm = 0.0;
  PerKind<double> unit{};                 // mm, mm/s, … per scaled unit
  std::vector<std::vector<double>> aims;  // of each model, at nodes and middles; one if all are r
  double jerk_weight = 0.0;               // ρ
  std::optional<Eigen::Vector4d> start;   // p, ṗ, b, ḃ at the first node
  std::optional<double> end_base;         // b at the last node, where ḃ = 0

  void assign(const AxisWindow& window);
  // Takes the window's aims anew.
  void set_aims();
  [[nodiscard]] const std::vector<double>& aim(std::size_t model) const {
    return aims[aims.size() == 1 ? 0 : model];
  }
  [[nodiscard]] double to_scaled_position(double mm) const;
  // Sets the base at its ends to exactly what the window gives, so that rounding has no effect
  // there.
  void keep_ends(dynamics::AxisTrajectory& base) const;
};

// Lower and upper bounds of the rows of one kind. Usually they are equal at all nodes but the first
// and the last.
struct RowBounds {
  Interval first;
  Interval inner;  // if they differ from node to node: the widest
  Interval last;
  std::vector<Interval> each = {};  // of every node, if they differ from node to node

  [[nodiscard]] const Interval& at(std::size_t k, std::size_t nodes) const {
    if (!each.empty()) {
      return each[k];
    }
    return k == 0 ? first : (k + 1 == nodes ? last : inner);
  }
};

// The bounds of those kinds that the active limits bound.
[[nodiscard]] PerKind<std::optional<RowBounds>> row_bounds(const ScaledWindow& scaled,
                                                           const ActiveLimits& active);

}  // namespace unflex::compensate
