// Notation:
//   x = n π/2 + r      for sin and cos, |r| ≤ π/4
//   q = c + …, c = j/8   for atan:  atan q = atan c + atan t,  t = (q − c) / (1 + c q)
//
// Both are the usual reductions; see J.-M. Muller, Elementary Functions, 3rd ed., § 11. hypot is
// from C. F. Borges, An improved algorithm for hypot(a, b), arXiv:1904.09481, algorithm 3.
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>

#include "unflex/core/math.hpp"
#include "unflex/core/pair.hpp"

namespace unflex::math {
namespace {

constexpr Pair kHalfPi = {0x1.921fb54442d18p+0, 0x1.1a62633145c07p-54};
constexpr Pair kPi = {0x1.921fb54442d18p+1, 0x1.1a62633145c07p-53};

// Adding and subtracting it rounds to whole numbers.
constexpr double kRound = 0x1.8p52;

struct Reduced {
  unsigned quarter = 0;  // n modulo 4
  Pair r;
};

Reduced reduced(double x) {
  // π/2 in parts. The first three have 22 bits, so n < 2³¹ times them is exact.
  constexpr double kMost = 3e9;
  constexpr double k1 = 0x1.921fb00000000p+0;
  constexpr double k2 = 0x1.5110b00000000p-22;
  constexpr double k3 = 0x1.1846980000000p-44;
  constexpr Pair k4 = {0x1.3198a2e037073p-69, 0x1.129024e088a68p-123};
  constexpr double kPerHalfPi = 0x1.45f306dc9c883p-1;
  constexpr double kWholeTurn = 0x1.921fb54442d18p+2;
  if (std::abs(x) > kMost) {
    x = std::fmod(x, kWholeTurn);
  }
  const double n = (x * kPerHalfPi + kRound) - kRound;
  const Pair r = sum(sum(x - n * k1, -n * k2), {-n * k3, 0.0});
  return {static_cast<unsigned>(static_cast<std::int64_t>(n) & 3), sum(r, product({-n, 0.0}, k4))};
}

double sin_of(const Pair& r) {
  const double z = r.high * r.high;
  double series = 0.0;
  for (int n = 17; n >= 5; n -= 2) {
    series = z / (n * (n - 1)) * (1.0 - series);
  }
  // sin r = r − r³/6 (1 − series)
  const double cubic = r.high * z * (1.0 / 6) * (1.0 - series);
  return r.high - (cubic - r.low * (1.0 - 0.5 * z));
}

double cos_of(const Pair& r) {
  const double z = r.high * r.high;
  double series = 0.0;
  for (int n = 18; n >= 6; n -= 2) {
    series = z / (n * (n - 1)) * (1.0 - series);
  }
  // cos r = 1 − r²/2 + r⁴/24 (1 − series)
  const double half = 0.5 * z;
  const double one_less = 1.0 - half;
  return one_less +
         (((1.0 - one_less) - half) + (z * z * (1.0 / 24) * (1.0 - series) - r.high * r.low));
}

// sin (x + quarters · π/2)
double sine(double x, unsigned quarters) {
  if (!(std::abs(x) < std::numeric_limits<double>::infinity())) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  const Reduced at = reduced(x);
  const unsigned quarter = (at.quarter + quarters) & 3U;
  const double value = (quarter & 1U) != 0 ? cos_of(at.r) : sin_of(at.r);
  return quarter >= 2 ? -value : value;
}

// atan (b / a) for a ≥ b ≥ 0, a > 0.
Pair small_angle(double b, double a) {
  constexpr double kStraight = 0x1p-30;  // atan q is q up to here
  if (b <= kStraight * a) {
    return {b / a, 0.0};
  }
  // Products must neither overflow nor vanish.
  int exponent = 0;
  static_cast<void>(std::frexp(a, &exponent));
  a = std::ldexp(a, -exponent);
  b = std::ldexp(b, -exponent);
  constexpr std::size_t kParts = 8;
  static constexpr std::array<Pair, kParts + 1> kAngles = {{
      {0x0.0p+0, 0x0.0p+0},
      {0x1.fd5ba9aac2f6ep-4, -0x1.cd37686760c17p-59},
      {0x1.f5b75f92c80ddp-3, 0x1.8ab6e3cf7afbdp-57},
      {0x1.6f61941e4def1p-2, -0x1.c63aae6f6e918p-56},
      {0x1.dac670561bb4fp-2, 0x1.a2b7f222f65e2p-56},
      {0x1.1e00babdefeb4p-1, -0x1.928df287a668fp-58},
      {0x1.4978fa3269ee1p-1, 0x1.2419a87f2a458p-56},
      {0x1.700a7c5784634p-1, -0x1.8c34d25aadef6p-56},
      {0x1.921fb54442d18p-1, 0x1.1a62633145c07p-55},
  }};
  const double eighths = (b / a * static_cast<double>(kParts) + kRound) - kRound;
  const double c = eighths / static_cast<double>(kParts);
  const Pair cut = product(-c, a);
  const Pair across = sum({b, 0.0}, cut);
  const Pair along = sum({a, 0.0}, product(c, b));
  const Pair t = quotient(across, along);
  const double z = t.high * t.high;
  double series = 0.0;
  for (int n = 15; n >= 3; n -= 2) {
    series = z * (1.0 / n - series);
  }
  const Pair& angle = kAngles[static_cast<std::size_t>(eighths)];
  return sum(angle, {t.high, t.low - t.high * series});
}

}  // namespace

double sin(double x) { return x == 0.0 ? x : sine(x, 0); }

double cos(double x) { return sine(x, 1); }

double atan2(double y, double x) {
  if (std::isnan(x) || std::isnan(y)) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  double a = std::abs(x);
  double b = std::abs(y);
  if (std::isinf(a) || std::isinf(b)) {
    // Ones take the place of infinite values, and zeros the place of the others.
    a = std::isinf(a) ? 1.0 : 0.0;
    b = std::isinf(b) ? 1.0 : 0.0;
  }
  Pair angle;
  const bool is_steep = b > a;
  if (is_steep) {
    std::swap(a, b);
  }
  if (a > 0.0) {
    angle = small_angle(b, a);
  }
  if (is_steep) {
    angle = sum(kHalfPi, {-angle.high, -angle.low});
  }
  if (x < 0.0) {
    angle = sum(kPi, {-angle.high, -angle.low});
  }
  return std::copysign(angle.high + angle.low, y);
}

double atan(double x) { return atan2(x, 1.0); }

double hypot(double x, double y) {
  double a = std::abs(x);
  double b = std::abs(y);
  if (a < b) {
    std::swap(a, b);
  }
  if (!(a < std::numeric_limits<double>::infinity()) || std::isnan(b)) {
    return std::isinf(a) || std::isinf(b) ? std::numeric_limits<double>::infinity() : a + b;
  }
  constexpr double kBig = 0x1p500;
  constexpr double kSmall = 0x1p-450;
  constexpr double kNothing = 0x1p-54;
  if (b <= kNothing * a) {
    return a + b;
  }
  // Squares must neither overflow nor vanish.
  constexpr double kUp = 0x1p600;
  constexpr double kDown = 0x1p-600;
  if (a > kBig) {
    return kUp * hypot(kDown * a, kDown * b);
  }
  if (b < kSmall) {
    return kDown * hypot(kUp * a, kUp * b);
  }
  const double h = std::sqrt(a * a + b * b);
  // h² − a² − b², in a form that rounds little.
  double excess = 0.0;
  if (h <= 2.0 * b) {
    const double d = h - b;
    excess = a * (2.0 * d - a) + (d - 2.0 * (a - b)) * d;
  } else {
    const double d = h - a;
    excess = 2.0 * d * (a - 2.0 * b) + ((4.0 * d - b) * b + d * d);
  }
  return h - excess / (2.0 * h);
}

}  // namespace unflex::math
