// Functions of real numbers whose results are the same to the last bit on every processor and
// system. The C library's results are not: each library rounds in its own way, and some choose
// their code by the processor. Emitted files would then depend on where they were made.
//
// Only additions, multiplications, divisions and square roots are used, which IEEE 754 defines to
// the bit. Results are within 1 ulp of the true value, but for tanh(), which is within 3.
#pragma once

namespace unflex::math {

[[nodiscard]] double exp(double x);
[[nodiscard]] double exp2(double x);
[[nodiscard]] double expm1(double x);
// Logarithms of negative numbers are not a number.
[[nodiscard]] double log(double x);
[[nodiscard]] double log2(double x);
[[nodiscard]] double log10(double x);
// xʸ for x ≥ 0. For a negative x the result is not a number, whatever y is.
[[nodiscard]] double pow(double x, double y);
[[nodiscard]] double tanh(double x);

// x in radians. Beyond 3e9 the result belongs to an angle that is off by 1e-16 of x, so it is not
// within 1 ulp.
[[nodiscard]] double sin(double x);
[[nodiscard]] double cos(double x);
// In [−π, π]; 0 if both are 0.
[[nodiscard]] double atan2(double y, double x);
[[nodiscard]] double atan(double x);

[[nodiscard]] double hypot(double x, double y);
[[nodiscard]] inline double hypot(double x, double y, double z) { return hypot(hypot(x, y), z); }

[[nodiscard]] constexpr double square(double x) { return x * x; }
// xⁿ for n ≥ 0, by n − 1 multiplications.
[[nodiscard]] constexpr double power(double x, int n) {
  double result = n > 0 ? x : 1.0;
  for (int i = 1; i < n; ++i) {
    result *= x;
  }
  return result;
}

}  // namespace unflex::math
