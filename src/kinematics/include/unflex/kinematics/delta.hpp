// The linear delta: three carriages on upright towers, and rods from them to the tool.
//
//   d_i = p_xy − tower_i     w_i = √(L_i² − |d_i|²)
//   q_i = z + w_i            J_i = (−d_ix/w_i, −d_iy/w_i, 1)
//   q̈_i = a_z − (d_i·a + |v|²)/w_i − (d_i·v)²/w_i³     a, v: of x and y
//
// Klipper's klippy/kinematics/delta.py has the same equations. Clavel: Conception d'un robot
// parallèle rapide à 4 degrés de liberté, EPFL 1991.
#pragma once

#include <array>
#include <optional>
#include <string>

#include "unflex/core/axes.hpp"
#include "unflex/core/error.hpp"
#include "unflex/kinematics/matrix.hpp"

namespace unflex::kinematics {

// Where a tower stands, seen from the tool's zero, less the joint's place on the tool.
struct Tower {
  double x_mm = 0.0;
  double y_mm = 0.0;
  double rod_mm = 0.0;  // L
};

struct Delta {
  std::array<Tower, 3> towers;

  static constexpr bool kIsUniform = false;
};

// A delta whose towers stand on a circle, at these angles from X towards Y, with rods of one
// length.
[[nodiscard]] Delta delta_on_circle(double radius_mm, double rod_mm,
                                    const std::array<double, 3>& angles_rad);

// A rod that is not steeper than this share of its length, w / L, makes the machine nearly
// singular.
inline constexpr double kLeastRise = 0.05;

// An error where a rod is too short.
[[nodiscard]] Result<Joints> to_joints(const Delta& machine, const Point& p);
// By trilateration: the lower of the two places that are a rod away from each carriage. An error
// where there is none.
[[nodiscard]] Result<Point> to_point(const Delta& machine, const Joints& q);
// Not a number where a rod is too short, like joint_acceleration().
[[nodiscard]] Matrix jacobian(const Delta& machine, const Point& p);
[[nodiscard]] Joints joint_acceleration(const Delta& machine, const Point& p, const Point& v,
                                        const Point& a);
// By the bound of the error of a line of length s, √3 ‖J⁻¹‖ s² (|u_xy|² + w′²)/(8 w), with w′ =
// −(d·u)/w, whose largest value at both ends and in the middle counts.
[[nodiscard]] double longest_line_mm(const Delta& machine, const Point& p, const Point& direction,
                                     double tolerance_mm);
// A rod that is too short or too flat.
[[nodiscard]] std::optional<std::string> fault(const Delta& machine, const Point& p);

// ‖J⁻¹‖ times the largest (|u_xy|² + w′²)/w of the three rods, 1/mm, for a unit vector u. Infinite
// where a rod is too flat. A line of length s that is straight in the joints leaves the tool's line
// by s²/8 times this, as long as it hardly changes along the line.
[[nodiscard]] double bend_of_line(const Delta& machine, const Point& p, const Point& u);

}  // namespace unflex::kinematics
