// How a machine's motors move its axes.
//
//   q_i = Σ_j g_ij p_j      q  where motor i is      p  where the tool is: X, Y, Z
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "unflex/core/axes.hpp"
#include "unflex/core/firmware.hpp"

namespace unflex {

enum class Kinematics {
  cartesian,
  corexy,
  corexz,
  hybrid_corexy,
  hybrid_corexy_inverted,  // the belt of X goes around the other way
  hybrid_corexz,
  tripteron,  // three parallel rails along X, and on each a leg that stays in a plane
  linear,     // any other linear map
};

// As the configuration spells it, which is Klipper's way: "cartesian", "corexy", "corexz",
// "hybrid_corexy", "hybrid_corexy_inverted", "hybrid_corexz"; and "tripteron", "linear".
[[nodiscard]] std::string_view to_string(Kinematics kinematics);

// All kinematics, in the order of the enumeration.
[[nodiscard]] std::span<const Kinematics> all_kinematics();

// The linear map from axes to motors: 3 × 3, motors by axes, without unit.
class Motors {
 public:
  static constexpr std::size_t kCount = 3;
  using Row = std::array<double, kCount>;
  using Rows = std::array<Row, kCount>;

  // Each axis has a motor of its own.
  Motors() = default;
  // The motors "A", "B" and "C" of any linear machine. fault(rows) must be nullopt.
  explicit Motors(const Rows& rows);
  // Klipper: klippy/kinematics; Marlin 2.1: src/module/planner.cpp, _populate_block;
  // RepRapFirmware 3.5: src/Movement/Kinematics/CoreKinematics.cpp, whose coreXZ turns a motor
  // three times as far for Z as for X. A linear machine has no rows of its own: it is cartesian
  // here.
  //
  // The planes of a tripteron's legs are such that A and B do X + Y − Z and X − Y − Z, and C does
  // X + Z.
  Motors(Kinematics kinematics, Firmware firmware);

  // Why no machine can have these rows; nullopt if it can. The rows must be independent, and not
  // nearly dependent: the determinant at least 1e-3, and the largest singular value at most 20
  // times the smallest.
  [[nodiscard]] static std::optional<std::string> fault(const Rows& rows);

  [[nodiscard]] const Rows& rows() const { return rows_; }
  // The map from motors to axes: axes by motors.
  [[nodiscard]] Rows inverse() const;
  // "X", "Y" and "Z"; "A" and "B" for a CoreXY's belts; "A", "B" and "C" for a tripteron and for
  // other linear machines.
  [[nodiscard]] const std::array<std::string_view, kCount>& names() const { return names_; }

  // Whether motor i has a part in moving X or Y.
  [[nodiscard]] bool moves_xy(std::size_t i) const {
    return rows_[i][0] != 0.0 || rows_[i][1] != 0.0;
  }
  // Whether there is a motor that moves both X and Y.
  [[nodiscard]] bool shared_by_xy() const;

  // The motion of motor i for the motion x, y, z of the axes. Both are travels, velocities or
  // accelerations.
  [[nodiscard]] double of(std::size_t i, double x, double y, double z) const {
    return rows_[i][0] * x + rows_[i][1] * y + rows_[i][2] * z;
  }
  // axes: X, Y, Z and any further ones.
  template <std::size_t kAxes>
  [[nodiscard]] double of(std::size_t i, const std::array<double, kAxes>& axes) const {
    return of(i, axes[0], axes[1], axes[2]);
  }
  // Where the axes are when the motors are at q.
  [[nodiscard]] std::array<double, kCount> axes(const std::array<double, kCount>& q) const;

  // The largest magnitude of motion of any motor of X or Y, for the motion x, y, z of the axes.
  [[nodiscard]] double largest_of_xy(const Axes<double>& xy, double z = 0.0) const;
  // The most that a motor moves per motion of X alone, or of Y alone: 1 where belts are not geared.
  [[nodiscard]] double gain_of_xy() const;
  // The most that a motor moves if X and Y both move by 1.
  [[nodiscard]] double gain_of_both() const;
  // The uncertainty of motor i if every axis has an uncertainty of 1.
  [[nodiscard]] double uncertainty(std::size_t i) const {
    return std::abs(rows_[i][0]) + std::abs(rows_[i][1]) + std::abs(rows_[i][2]);
  }

 private:
  Rows rows_{{{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}}};
  std::array<std::string_view, kCount> names_{"X", "Y", "Z"};
};

}  // namespace unflex
