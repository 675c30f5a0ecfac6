// Four numbers that are worked on at once: in two registers of two numbers, which all 64-bit
// processors have, or in one of four, which newer ones have. Both do the same operations on the
// same numbers in the same order, so results do not depend on the processor to the last bit.
//
// Code for both is a template over `Lanes`, in a file that is included twice: once as it is, and
// once between UNFLEX_FOUR_LANES_BEGIN and UNFLEX_FOUR_LANES_END, which tell the compiler that it
// may use the wide registers. Nothing but such templates may stand between these two: a function
// that other files share would be compiled for newer processors only. The functions here are no
// members, since GCC 12 breaks down over members without optimisation.
#pragma once

#include <cstddef>

#if defined(__x86_64__) && !defined(_WIN32) && defined(__clang__)
#define UNFLEX_FOUR_LANES
#define UNFLEX_FOUR_LANES_BEGIN \
  _Pragma("clang attribute push(__attribute__((target(\"avx2\"))), apply_to = function)")
#define UNFLEX_FOUR_LANES_END _Pragma("clang attribute pop")
#elif defined(__x86_64__) && !defined(_WIN32) && defined(__GNUC__)
// On Windows GCC does not align the stack for such registers (GCC bug 54412).
#define UNFLEX_FOUR_LANES
#define UNFLEX_FOUR_LANES_BEGIN _Pragma("GCC push_options") _Pragma("GCC target(\"avx2\")")
#define UNFLEX_FOUR_LANES_END _Pragma("GCC pop_options")
#endif

namespace unflex {

// The numbers of `Lanes`.
inline constexpr std::size_t kLanes = 4;

// Whether to use the wide registers. The processor decides, unless prefer_two_lanes() overrides it.
[[nodiscard]] bool has_four_lanes();
// Applies to the whole process. A processor that has both kinds can so try the narrow registers.
void prefer_two_lanes(bool prefer);

using TwoNumbers [[gnu::vector_size(16)]] = double;
using TwoPlaces [[gnu::vector_size(16)]] = long long;

template <class Lanes>
[[nodiscard]] inline Lanes load(const double* from);
template <class Lanes>
[[nodiscard]] inline Lanes broadcast(double value);
template <class Lanes>
[[nodiscard]] inline Lanes gathered(double a, double b, double c, double d);

// In two registers.
struct TwoLanes {
  TwoNumbers low;   // 0 and 1
  TwoNumbers high;  // 2 and 3
};

struct TwoLanesMask {
  TwoPlaces low;
  TwoPlaces high;
};

template <>
[[nodiscard]] inline TwoLanes load<TwoLanes>(const double* from) {
  TwoLanes result;
  __builtin_memcpy(&result.low, from, sizeof result.low);
  __builtin_memcpy(&result.high, from + 2, sizeof result.high);
  return result;
}
template <>
[[nodiscard]] inline TwoLanes broadcast<TwoLanes>(double value) {
  return {TwoNumbers{value, value}, TwoNumbers{value, value}};
}
template <>
[[nodiscard]] inline TwoLanes gathered<TwoLanes>(double a, double b, double c, double d) {
  return {TwoNumbers{a, b}, TwoNumbers{c, d}};
}
inline void store(const TwoLanes& lanes, double* to) {
  __builtin_memcpy(to, &lanes.low, sizeof lanes.low);
  __builtin_memcpy(to + 2, &lanes.high, sizeof lanes.high);
}
[[nodiscard]] inline TwoLanes operator+(const TwoLanes& a, const TwoLanes& b) {
  return {a.low + b.low, a.high + b.high};
}
[[nodiscard]] inline TwoLanes operator-(const TwoLanes& a, const TwoLanes& b) {
  return {a.low - b.low, a.high - b.high};
}
[[nodiscard]] inline TwoLanes operator*(const TwoLanes& a, const TwoLanes& b) {
  return {a.low * b.low, a.high * b.high};
}
[[nodiscard]] inline TwoLanes operator/(const TwoLanes& a, const TwoLanes& b) {
  return {a.low / b.low, a.high / b.high};
}
[[nodiscard]] inline TwoLanes operator*(double a, const TwoLanes& b) {
  return {a * b.low, a * b.high};
}
// (0 + 2) + (1 + 3)
[[nodiscard]] inline double sum(const TwoLanes& lanes) {
  const TwoNumbers both = lanes.low + lanes.high;
  return both[0] + both[1];
}
[[nodiscard]] inline TwoLanesMask less(const TwoLanes& a, const TwoLanes& b) {
  return {a.low < b.low, a.high < b.high};
}
// Numbers of a where the mask is set, of b elsewhere.
[[nodiscard]] inline TwoLanes select(const TwoLanesMask& mask, const TwoLanes& a,
                                     const TwoLanes& b) {
  return {mask.low ? a.low : b.low, mask.high ? a.high : b.high};
}
[[nodiscard]] inline TwoLanes smaller(const TwoLanes& a, const TwoLanes& b) {
  return select(less(a, b), a, b);
}
[[nodiscard]] inline TwoLanes larger(const TwoLanes& a, const TwoLanes& b) {
  return select(less(b, a), a, b);
}
[[nodiscard]] inline double least_of(const double* each) {
  const double first = each[0] < each[1] ? each[0] : each[1];
  const double second = each[2] < each[3] ? each[2] : each[3];
  return first < second ? first : second;
}
// The least of the four numbers, and the most.
[[nodiscard]] inline double least(const TwoLanes& lanes) {
  double each[kLanes];
  store(lanes, each);
  return least_of(each);
}
[[nodiscard]] inline double most(const TwoLanes& lanes) { return -least(-1.0 * lanes); }
// Rows become columns.
inline void transpose(TwoLanes& a, TwoLanes& b, TwoLanes& c, TwoLanes& d) {
  const auto column = [](double e, double f, double g, double h) {
    return gathered<TwoLanes>(e, f, g, h);
  };
  const TwoLanes first = column(a.low[0], b.low[0], c.low[0], d.low[0]);
  const TwoLanes second = column(a.low[1], b.low[1], c.low[1], d.low[1]);
  const TwoLanes third = column(a.high[0], b.high[0], c.high[0], d.high[0]);
  d = column(a.high[1], b.high[1], c.high[1], d.high[1]);
  a = first;
  b = second;
  c = third;
}

#ifdef UNFLEX_FOUR_LANES
UNFLEX_FOUR_LANES_BEGIN

using FourNumbers [[gnu::vector_size(32)]] = double;
using FourPlaces [[gnu::vector_size(32)]] = long long;

// In one register.
struct FourLanes {
  FourNumbers all;
};

struct FourLanesMask {
  FourPlaces all;
};

template <>
[[nodiscard]] inline FourLanes load<FourLanes>(const double* from) {
  FourLanes result;
  __builtin_memcpy(&result.all, from, sizeof result.all);
  return result;
}
template <>
[[nodiscard]] inline FourLanes broadcast<FourLanes>(double value) {
  return {FourNumbers{value, value, value, value}};
}
template <>
[[nodiscard]] inline FourLanes gathered<FourLanes>(double a, double b, double c, double d) {
  return {FourNumbers{a, b, c, d}};
}
inline void store(const FourLanes& lanes, double* to) {
  __builtin_memcpy(to, &lanes.all, sizeof lanes.all);
}
[[nodiscard]] inline FourLanes operator+(const FourLanes& a, const FourLanes& b) {
  return {a.all + b.all};
}
[[nodiscard]] inline FourLanes operator-(const FourLanes& a, const FourLanes& b) {
  return {a.all - b.all};
}
[[nodiscard]] inline FourLanes operator*(const FourLanes& a, const FourLanes& b) {
  return {a.all * b.all};
}
[[nodiscard]] inline FourLanes operator/(const FourLanes& a, const FourLanes& b) {
  return {a.all / b.all};
}
[[nodiscard]] inline FourLanes operator*(double a, const FourLanes& b) { return {a * b.all}; }
[[nodiscard]] inline double sum(const FourLanes& lanes) {
  const TwoNumbers low = __builtin_shufflevector(lanes.all, lanes.all, 0, 1);
  const TwoNumbers high = __builtin_shufflevector(lanes.all, lanes.all, 2, 3);
  const TwoNumbers both = low + high;
  return both[0] + both[1];
}
[[nodiscard]] inline FourLanesMask less(const FourLanes& a, const FourLanes& b) {
  return {a.all < b.all};
}
[[nodiscard]] inline FourLanes select(const FourLanesMask& mask, const FourLanes& a,
                                      const FourLanes& b) {
  return {mask.all ? a.all : b.all};
}
[[nodiscard]] inline FourLanes smaller(const FourLanes& a, const FourLanes& b) {
  return select(less(a, b), a, b);
}
[[nodiscard]] inline FourLanes larger(const FourLanes& a, const FourLanes& b) {
  return select(less(b, a), a, b);
}
[[nodiscard]] inline double least(const FourLanes& lanes) {
  double each[kLanes];
  store(lanes, each);
  return least_of(each);
}
[[nodiscard]] inline double most(const FourLanes& lanes) { return -least(-1.0 * lanes); }
inline void transpose(FourLanes& a, FourLanes& b, FourLanes& c, FourLanes& d) {
  const FourNumbers even = __builtin_shufflevector(a.all, b.all, 0, 4, 2, 6);
  const FourNumbers odd = __builtin_shufflevector(a.all, b.all, 1, 5, 3, 7);
  const FourNumbers more_even = __builtin_shufflevector(c.all, d.all, 0, 4, 2, 6);
  const FourNumbers more_odd = __builtin_shufflevector(c.all, d.all, 1, 5, 3, 7);
  a.all = __builtin_shufflevector(even, more_even, 0, 1, 4, 5);
  b.all = __builtin_shufflevector(odd, more_odd, 0, 1, 4, 5);
  c.all = __builtin_shufflevector(even, more_even, 2, 3, 6, 7);
  d.all = __builtin_shufflevector(odd, more_odd, 2, 3, 6, 7);
}

UNFLEX_FOUR_LANES_END
#else
#define UNFLEX_FOUR_LANES_BEGIN
#define UNFLEX_FOUR_LANES_END
// There are no wide registers here, and has_four_lanes() returns false.
using FourLanes = TwoLanes;
#endif

}  // namespace unflex
