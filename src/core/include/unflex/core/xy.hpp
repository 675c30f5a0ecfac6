// Places, ways and directions in the plane of X and Y.
#pragma once

#include <cmath>

#include "unflex/core/axes.hpp"
#include "unflex/core/math.hpp"

namespace unflex {

using XY = Axes<double>;

// The part of X and Y in a position, a direction or a difference of all axes.
template <typename Vector>
[[nodiscard]] constexpr XY xy_of(const Vector& of_all_axes) {
  return {of_all_axes[0], of_all_axes[1]};
}

// Puts a place in the plane into a position of all axes.
template <typename Vector>
constexpr void set_xy(Vector& of_all_axes, const XY& xy) {
  of_all_axes[0] = xy.x;
  of_all_axes[1] = xy.y;
}

[[nodiscard]] constexpr XY operator+(const XY& a, const XY& b) { return {a.x + b.x, a.y + b.y}; }
[[nodiscard]] constexpr XY operator-(const XY& a, const XY& b) { return {a.x - b.x, a.y - b.y}; }
[[nodiscard]] constexpr XY operator-(const XY& a) { return {-a.x, -a.y}; }
[[nodiscard]] constexpr XY operator*(double factor, const XY& a) {
  return {factor * a.x, factor * a.y};
}
[[nodiscard]] constexpr XY operator/(const XY& a, double divisor) {
  return {a.x / divisor, a.y / divisor};
}

// a·b = |a| |b| cos φ, and a×b = |a| |b| sin φ, where φ is the angle from a to b.
[[nodiscard]] constexpr double dot(const XY& a, const XY& b) { return a.x * b.x + a.y * b.y; }
[[nodiscard]] constexpr double cross(const XY& a, const XY& b) { return a.x * b.y - a.y * b.x; }
// |a|², faster than |a|.
[[nodiscard]] constexpr double squared(const XY& a) { return dot(a, a); }
[[nodiscard]] inline double length(const XY& a) { return math::hypot(a.x, a.y); }
[[nodiscard]] inline double distance(const XY& a, const XY& b) { return length(b - a); }
// The larger of |x| and |y|.
[[nodiscard]] inline double largest_part(const XY& a) {
  return most_of_axes([](double part) { return std::abs(part); }, a);
}
// |x| + |y|, as belts that drive both axes feel it.
[[nodiscard]] inline double taxicab(const XY& a) {
  return sum_of_axes([](double part) { return std::abs(part); }, a);
}
// The direction from the X axis, rad, in [−π, π].
[[nodiscard]] inline double angle_rad(const XY& a) { return math::atan2(a.y, a.x); }
// a, turned by 90° counterclockwise.
[[nodiscard]] constexpr XY turned_left(const XY& a) { return {-a.y, a.x}; }

}  // namespace unflex
