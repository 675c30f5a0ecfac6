// A machine whose modes are not its axes: masses that hang on the drives of several motors.
//
//   M p̈ + C (ṗ − ḃ) + K (p − b) = 0         p  nozzle     b  base: where the motors put the tool
//   K φ_j = ω_j² M φ_j,  |φ_j| = 1           M, C, K  masses, damping and stiffness by axes X, Y, Z
//
// In mode coordinates u = T p, with p = Φ u, each mode is an axis by itself (flexible_axis.hpp):
//
//   ü_j + 2ζ_j ω_j (u̇_j − β̇_j) + ω_j² (u_j − β_j) = 0       β = T b     T = Φ⁻¹
//
// What Φᵀ C Φ has off its diagonal is left out. Meirovitch, Fundamentals of Vibrations, § 7.7.
//
// On such a machine a NozzleXY says how far each mode is ahead of the base, y = u − β, and how fast
// it is, u̇: parts[j] of X is that of mode j. So a nozzle at rest is {}, wherever it is.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "unflex/core/axes.hpp"
#include "unflex/core/error.hpp"
#include "unflex/core/xy.hpp"
#include "unflex/dynamics/base_trajectory.hpp"
#include "unflex/dynamics/flexible_axis.hpp"

namespace unflex::dynamics {

class ModeFrame {
 public:
  static constexpr std::size_t kCount = 3;
  using Vector = std::array<double, kCount>;  // by axes, or by modes
  using Matrix = std::array<Vector, kCount>;

  // kg, N/mm = kN/m and N·s/mm. An axis without stiffness is rigid: then no other axis may have a
  // part in it.
  struct Masses {
    Matrix mass_kg{};
    Matrix damping_n_s_mm{};
    Matrix stiffness_n_mm{};
  };
  // An error of kind input if a mode has no mass, no stiffness, or a damping ratio of 1 or more.
  // The mode of number i is the one that is mostly along axis i.
  [[nodiscard]] static Result<ModeFrame> of(const Masses& masses);

  // Without gain. Unset: the axis of this number is rigid.
  [[nodiscard]] const std::optional<Mode>& mode(std::size_t i) const { return modes_[i]; }
  // T v and Φ v.
  [[nodiscard]] Vector to_modes(const Vector& of_axes) const { return times(to_modes_, of_axes); }
  [[nodiscard]] Vector to_axes(const Vector& of_modes) const { return times(to_axes_, of_modes); }
  [[nodiscard]] const Matrix& to_axes() const { return to_axes_; }
  // The share of mode `mode` in the way of axis `axis` while all of the base moves along that axis.
  [[nodiscard]] double gain(std::size_t axis, std::size_t mode) const {
    return to_axes_[axis][mode] * to_modes_[mode][axis];
  }
  // What Φᵀ C Φ has off its diagonal, relative to the geometric mean of the diagonal.
  [[nodiscard]] double left_out() const { return left_out_; }
  // All frequencies times this factor.
  [[nodiscard]] ModeFrame detuned(double factor) const;

  // The nozzle of a base that has long been in even motion.
  [[nodiscard]] NozzleXY riding(const Vector& velocity_mm_s) const;
  // The nozzle h seconds later. The base begins with this velocity, by axes, and its acceleration
  // is constant.
  void advance(const Vector& velocity_mm_s, const Vector& accel_mm_s2, double h,
               NozzleXY& nozzle) const;
  // How far the nozzle is ahead of the base, and its velocity: Φ y and Φ u̇.
  [[nodiscard]] std::array<NozzleMotion, kCount> ahead(const NozzleXY& nozzle) const;
  // The distance between two nozzles on one base, mm. Velocities count divided by ω.
  [[nodiscard]] double apart_mm(const NozzleXY& a, const NozzleXY& b) const;

 private:
  [[nodiscard]] static Vector times(const Matrix& matrix, const Vector& vector) {
    Vector result{};
    for (std::size_t i = 0; i < kCount; ++i) {
      for (std::size_t j = 0; j < kCount; ++j) {
        result[i] += matrix[i][j] * vector[j];
      }
    }
    return result;
  }

  std::array<std::optional<Mode>, kCount> modes_;
  Matrix to_modes_{};  // T, modes by axes
  Matrix to_axes_{};   // Φ, axes by modes
  double left_out_ = 0.0;
};

}  // namespace unflex::dynamics
