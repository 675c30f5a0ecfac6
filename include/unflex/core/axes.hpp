// A value for each axis whose nozzle swings: X and Y.
//
// Code for one axis is written once and applied to all axes. A further axis would be a further
// member here.
#pragma once

#include <cstddef>
#include <string_view>
#include <type_traits>
#include <utility>

namespace unflex {

template <typename T>
struct Axes {
  T x{};
  T y{};

  static constexpr std::size_t kCount = 2;

  // axis: below kCount; 0 is X, as in gcode::Axis.
  [[nodiscard]] constexpr T& operator[](std::size_t axis) { return axis == 0 ? x : y; }
  [[nodiscard]] constexpr const T& operator[](std::size_t axis) const { return axis == 0 ? x : y; }

  friend bool operator==(const Axes&, const Axes&) = default;
};

// The axes' letters as G-code and people write them, and as keys do.
inline constexpr Axes<std::string_view> kAxisLetters{"X", "Y"};
inline constexpr Axes<std::string_view> kAxisKeys{"x", "y"};

// One value for every axis.
template <typename T>
[[nodiscard]] constexpr Axes<T> on_all_axes(const T& value) {
  return {value, value};
}

// Calls f(v, …) for each axis in turn. v is the axis' part of a value.
template <typename F, typename... Values>
constexpr void for_each_axis(F&& f, Values&&... values) {
  f(std::forward<Values>(values).x...);
  f(std::forward<Values>(values).y...);
}

// The results of f(v, …) for each axis in turn.
template <typename F, typename... Values>
[[nodiscard]] constexpr auto map_axes(F&& f, const Values&... values) {
  using Of = std::remove_cvref_t<decltype(f(values.x...))>;
  return Axes<Of>{f(values.x...), f(values.y...)};
}

// Whether f(v, …) holds for at least one axis.
template <typename F, typename... Values>
[[nodiscard]] constexpr bool any_axis(F&& f, const Values&... values) {
  return f(values.x...) || f(values.y...);
}

// Whether f(v, …) holds for every axis.
template <typename F, typename... Values>
[[nodiscard]] constexpr bool all_axes(F&& f, const Values&... values) {
  return f(values.x...) && f(values.y...);
}

// The smallest and the largest value of f(v, …), a number, over the axes.
template <typename F, typename... Values>
[[nodiscard]] constexpr auto least_of_axes(F&& f, const Values&... values) {
  const auto first = f(values.x...);
  const auto second = f(values.y...);
  return second < first ? second : first;
}
template <typename F, typename... Values>
[[nodiscard]] constexpr auto most_of_axes(F&& f, const Values&... values) {
  const auto first = f(values.x...);
  const auto second = f(values.y...);
  return first < second ? second : first;
}
// The values of f(v, …), added up.
template <typename F, typename... Values>
[[nodiscard]] constexpr auto sum_of_axes(F&& f, const Values&... values) {
  const auto first = f(values.x...);
  return first + f(values.y...);
}

}  // namespace unflex
