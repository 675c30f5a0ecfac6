// Places, ways and directions in the plane of X and Y.
//
// Numbers may be of any type that adds and multiplies: double, or Lanes of several problems.
#pragma once

#include <cmath>
#include <type_traits>

#include "unflex/core/axes.hpp"
#include "unflex/core/math.hpp"

namespace unflex {

using XY = Axes<double>;

// The part of X and Y in what is given for X, Y, Z and E: a position, a direction, what is known.
template <typename Vector>
[[nodiscard]] constexpr auto axes_of(const Vector& of_all_axes) {
  return Axes<std::remove_cvref_t<decltype(of_all_axes[0])>>{of_all_axes[0], of_all_axes[1]};
}
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

template <typename T>
[[nodiscard]] constexpr Axes<T> operator+(const Axes<T>& a, const Axes<T>& b) {
  return {a.x + b.x, a.y + b.y};
}
template <typename T>
[[nodiscard]] constexpr Axes<T> operator-(const Axes<T>& a, const Axes<T>& b) {
  return {a.x - b.x, a.y - b.y};
}
template <typename T>
[[nodiscard]] constexpr Axes<T> operator-(const Axes<T>& a) {
  return {-a.x, -a.y};
}
template <typename T>
[[nodiscard]] constexpr Axes<T> operator*(const T& factor, const Axes<T>& a) {
  return {factor * a.x, factor * a.y};
}
template <typename T>
[[nodiscard]] constexpr Axes<T> operator/(const Axes<T>& a, const T& divisor) {
  return {a.x / divisor, a.y / divisor};
}
template <typename T>
constexpr Axes<T>& operator+=(Axes<T>& a, const Axes<T>& b) {
  return a = a + b;
}
template <typename T>
constexpr Axes<T>& operator-=(Axes<T>& a, const Axes<T>& b) {
  return a = a - b;
}

// a·b = |a| |b| cos φ, and a×b = |a| |b| sin φ, where φ is the angle from a to b.
template <typename T>
[[nodiscard]] constexpr T dot(const Axes<T>& a, const Axes<T>& b) {
  return a.x * b.x + a.y * b.y;
}
template <typename T>
[[nodiscard]] constexpr T cross(const Axes<T>& a, const Axes<T>& b) {
  return a.x * b.y - a.y * b.x;
}
// |a|², faster than |a|.
template <typename T>
[[nodiscard]] constexpr T squared(const Axes<T>& a) {
  return dot(a, a);
}
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
template <typename T>
[[nodiscard]] constexpr Axes<T> turned_left(const Axes<T>& a) {
  return {-a.y, a.x};
}

}  // namespace unflex
