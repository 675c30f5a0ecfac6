// Numbers of twice the usual precision: the sum of two, of which the second is at most half a unit
// in the last place of the first.
//
// Sources: T. J. Dekker, A floating-point technique for extending the available precision, Numer.
// Math. 18, 1971 (product, quotient); D. E. Knuth, The Art of Computer Programming 2, § 4.2.2
// (sum).
#pragma once

namespace unflex::math {

struct Pair {
  double high = 0.0;
  double low = 0.0;
};

// a + b if |a| ≥ |b| or a is 0.
[[nodiscard]] inline Pair sum_of_ordered(double a, double b) {
  const double high = a + b;
  return {high, b - (high - a)};
}

[[nodiscard]] inline Pair sum(double a, double b) {
  const double high = a + b;
  const double of_b = high - a;
  return {high, (a - (high - of_b)) + (b - of_b)};
}

[[nodiscard]] inline Pair sum(const Pair& a, const Pair& b) {
  const Pair high = sum(a.high, b.high);
  return sum_of_ordered(high.high, high.low + (a.low + b.low));
}

// Exact for |a|, |b| < 1e150, if the product's last bit is above the smallest number.
[[nodiscard]] inline Pair product(double a, double b) {
  constexpr double kSplit = 134217729.0;  // 2²⁷ + 1
  const auto upper_half = [](double x) {
    const double far = kSplit * x;
    return far - (far - x);
  };
  const double a1 = upper_half(a);
  const double a2 = a - a1;
  const double b1 = upper_half(b);
  const double b2 = b - b1;
  const double high = a * b;
  return {high, ((a1 * b1 - high) + a1 * b2 + a2 * b1) + a2 * b2};
}

[[nodiscard]] inline Pair product(const Pair& a, const Pair& b) {
  const Pair high = product(a.high, b.high);
  return sum_of_ordered(high.high, high.low + (a.high * b.low + a.low * b.high));
}

[[nodiscard]] inline Pair quotient(const Pair& a, const Pair& b) {
  const double high = a.high / b.high;
  const Pair back = product(high, b.high);
  const double rest = ((a.high - back.high) - back.low) + (a.low - high * b.low);
  return sum_of_ordered(high, rest / b.high);
}

[[nodiscard]] inline Pair operator+(const Pair& a, const Pair& b) { return sum(a, b); }
[[nodiscard]] inline Pair operator-(const Pair& a) { return {-a.high, -a.low}; }
[[nodiscard]] inline Pair operator-(const Pair& a, const Pair& b) { return sum(a, -b); }
[[nodiscard]] inline Pair operator*(const Pair& a, const Pair& b) { return product(a, b); }
[[nodiscard]] inline Pair operator/(const Pair& a, const Pair& b) { return quotient(a, b); }

}  // namespace unflex::math
