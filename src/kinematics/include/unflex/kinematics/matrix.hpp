// Places of a machine, and the matrix between their motions.
//
//   q  joints     p  tool     J = ∂q/∂p     rows of J: joints, columns: X, Y, Z
#pragma once

#include <array>

#include "unflex/core/kinematics.hpp"

namespace unflex::kinematics {

// X, Y and Z of the tool in mm, or their velocities or accelerations.
using Point = std::array<double, 3>;
// Three joints, "A", "B", "C" or whatever the machine calls them: mm, mm/s or mm/s².
using Joints = std::array<double, 3>;
// Joints by axes, without unit.
using Matrix = Motors::Rows;

// m x
[[nodiscard]] Joints product(const Matrix& m, const Point& x);
// m⁻¹. The determinant of m must not be 0.
[[nodiscard]] Matrix inverse(const Matrix& m);
// The largest singular value of m over the smallest; infinite if that is 0.
[[nodiscard]] double condition(const Matrix& m);
// ‖m⁻¹‖, the largest that |m⁻¹ x| gets for |x| = 1; infinite if m has no inverse.
[[nodiscard]] double norm_of_inverse(const Matrix& m);

}  // namespace unflex::kinematics
