// How a machine's motors move its axes.
//
//   q_i = Σ_j g_ij p_j      q  where motor i is      p  where the tool is: X, Y, Z
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <span>
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
};

// As the configuration spells it, which is Klipper's way: "cartesian", "corexy", "corexz",
// "hybrid_corexy", "hybrid_corexy_inverted", "hybrid_corexz".
[[nodiscard]] std::string_view to_string(Kinematics kinematics);

// All kinematics, in the order of the enumeration.
[[nodiscard]] std::span<const Kinematics> all_kinematics();

// The linear map from axes to motors: 3 × 3, motors by axes, without unit.
class Motors {
 public:
  static constexpr std::size_t kCount = 3;
  using Rows = std::array<std::array<double, kCount>, kCount>;

  // Each axis has a motor of its own.
  Motors() = default;
  // Klipper: klippy/kinematics; Marlin 2.1: src/module/planner.cpp, _populate_block;
  // RepRapFirmware 3.5: src/Movement/Kinematics/CoreKinematics.cpp, whose coreXZ turns a motor
  // three times as far for Z as for X.
  Motors(Kinematics kinematics, Firmware firmware);

  [[nodiscard]] const Rows& rows() const { return rows_; }

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
  // The uncertainty of motor i if every axis has an uncertainty of 1.
  [[nodiscard]] double uncertainty(std::size_t i) const {
    return std::abs(rows_[i][0]) + std::abs(rows_[i][1]) + std::abs(rows_[i][2]);
  }

 private:
  Rows rows_{{{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}}};
};

}  // namespace unflex
