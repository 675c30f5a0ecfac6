// Notation:
//   x = n ln 2 / 16 + r,  n = 16 k + j      eˣ = 2ᵏ 2^(j/16) eʳ
//   x = 2ᵏ m,  √½ ≤ m < √2                  ln x = k ln 2 + 2 artanh s,  s = (m − 1) / (m + 1)
//
// Both are the usual reductions; see J.-M. Muller, Elementary Functions, 3rd ed., § 4.2 and 11.
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "unflex/core/math.hpp"
#include "unflex/core/pair.hpp"

namespace unflex::math {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

constexpr Pair kLn2 = {0x1.62e42fefa39efp-1, 0x1.abc9e3b39803fp-56};
constexpr Pair kPerLn2 = {0x1.71547652b82fep+0, 0x1.777d0ffda0d24p-56};
constexpr Pair kPerLn10 = {0x1.bcb7b1526e50ep-2, 0x1.95355baaafad3p-57};

// 2^(j/16)
constexpr std::size_t kParts = 16;
constexpr std::array<Pair, kParts> kRoots = {{
    {0x1.0000000000000p+0, 0x0.0p+0},
    {0x1.0b5586cf9890fp+0, 0x1.8a62e4adc610bp-54},
    {0x1.172b83c7d517bp+0, -0x1.19041b9d78a76p-55},
    {0x1.2387a6e756238p+0, 0x1.9b07eb6c70573p-54},
    {0x1.306fe0a31b715p+0, 0x1.6f46ad23182e4p-55},
    {0x1.3dea64c123422p+0, 0x1.ada0911f09ebcp-55},
    {0x1.4bfdad5362a27p+0, 0x1.d4397afec42e2p-56},
    {0x1.5ab07dd485429p+0, 0x1.6324c054647adp-54},
    {0x1.6a09e667f3bcdp+0, -0x1.bdd3413b26456p-54},
    {0x1.7a11473eb0187p+0, -0x1.41577ee04992fp-55},
    {0x1.8ace5422aa0dbp+0, 0x1.6e9f156864b27p-54},
    {0x1.9c49182a3f090p+0, 0x1.c7c46b071f2bep-56},
    {0x1.ae89f995ad3adp+0, 0x1.7a1cd345dcc81p-54},
    {0x1.c199bdd85529cp+0, 0x1.11065895048ddp-55},
    {0x1.d5818dcfba487p+0, 0x1.2ed02d75b3707p-55},
    {0x1.ea4afa2a490dap+0, -0x1.e9c23179c2893p-54},
}};

// e^kMost is the largest number. e^kLeast is less than half of the smallest one.
constexpr double kMost = 709.782712893384;
constexpr double kLeast = -745.1332191019412;

// 2ᵏ (high + low), kept apart so that neither is rounded yet.
struct Power {
  Pair value;
  int k = 0;
};

// e^(x + low) for kLeast ≤ x ≤ kMost and |low| small beside x.
Power power_of_e(double x, double low) {
  // ln 2 / 16 in two parts. The first has 36 bits, so n times it is exact.
  constexpr double kStep = 0x1.62e42fefa0000p-5;
  constexpr double kStepLow = 0x1.cf79abc9e3b3ap-44;
  constexpr double kPerStep = 0x1.71547652b82fep+4;
  constexpr double kRound = 0x1.8p52;  // adding and subtracting it rounds to whole numbers
  const double n = (x * kPerStep + kRound) - kRound;
  const double r = (x - n * kStep) - (n * kStepLow - low);
  // eʳ − 1 for |r| < 0.022
  const double p =
      r +
      r * r *
          (1.0 / 2 +
           r * (1.0 / 6 + r * (1.0 / 24 + r * (1.0 / 120 + r * (1.0 / 720 + r * (1.0 / 5040))))));
  const int whole = static_cast<int>(n);
  const int j = whole & (static_cast<int>(kParts) - 1);
  const Pair& root = kRoots[static_cast<std::size_t>(j)];
  return {{root.high, root.low + root.high * p}, (whole - j) / static_cast<int>(kParts)};
}

// 2ᵏ x, rounded once.
double scaled(double x, int k) {
  constexpr int kBias = 1023;
  constexpr int kMantissaBits = 52;
  if (k >= 1 - kBias && k <= kBias) {
    return x * std::bit_cast<double>(static_cast<std::uint64_t>(k + kBias) << kMantissaBits);
  }
  return std::ldexp(x, k);
}

// e^(x.high + x.low)
double exp(const Pair& x) {
  if (!(x.high <= kMost)) {
    return std::isnan(x.high) ? x.high : kInfinity;
  }
  if (x.high < kLeast) {
    return 0.0;
  }
  const Power power = power_of_e(x.high, x.low);
  return scaled(power.value.high + power.value.low, power.k);
}

// x = 2ᵏ (1 + f)
struct Split {
  double f = 0.0;
  int k = 0;
};

Split split(double x) {
  constexpr double kRootHalf = 0.7071067811865476;
  int k = 0;
  const double m = std::frexp(x, &k);
  return m < kRootHalf ? Split{2.0 * m - 1.0, k - 1} : Split{m - 1.0, k};
}

// ln 2 in two parts. The first has 40 bits, so k times it is exact.
constexpr double kLn2High = 0x1.62e42fefa2000p-1;
constexpr Pair kLn2Low = {0x1.9ef35793c7673p-41, 0x1.f97b57a079a19p-103};

// 1/7 + z/9 + z²/11 …, which are the last terms of artanh s / s for z = s².
double last_terms(double z) {
  double rest = 0.0;
  for (int odd = 23; odd >= 7; odd -= 2) {
    rest = 1.0 / odd + z * rest;
  }
  return rest;
}

// ln x for finite x > 0, to twice the usual precision.
Pair log_of(double x) {
  const auto [f, k] = split(x);
  const Pair s = quotient({f, 0.0}, sum(2.0, f));
  const Pair z = product(s, s);
  // artanh s / s − 1 = z/3 + z²/5 + z³/7 …. Only the first two need the precision.
  constexpr Pair kThird = {0x1.5555555555555p-2, 0x1.5555555555555p-56};
  constexpr Pair kFifth = {0x1.999999999999ap-3, -0x1.999999999999ap-57};
  const Pair series =
      product(z, sum(kThird, product(z, sum(kFifth, product(z, {last_terms(z.high), 0.0})))));
  const Pair twice = {2.0 * s.high, 2.0 * s.low};
  const Pair of_m = sum(twice, product(twice, series));
  const Pair of_k = sum({k * kLn2High, 0.0}, product({static_cast<double>(k), 0.0}, kLn2Low));
  return sum(of_k, of_m);
}

// The logarithm, to any base, of an x that log_of() does not take.
double log_at_edge(double x) {
  if (x == 0.0) {
    return -kInfinity;
  }
  return x > 0.0 ? x : kNaN;
}

bool has_log(double x) { return x > 0.0 && x < kInfinity; }

double log_to_base(double x, const Pair& per_ln) {
  return has_log(x) ? product(log_of(x), per_ln).high : log_at_edge(x);
}

}  // namespace

double exp(double x) { return exp(Pair{x, 0.0}); }

double exp2(double x) {
  // Beyond this the result is 0 or infinite, and the product might not be a number.
  constexpr double kFar = 2000.0;
  return std::abs(x) < kFar ? exp(product({x, 0.0}, kLn2)) : exp(x);
}

double expm1(double x) {
  constexpr double kSmall = 0.25;
  if (std::abs(x) < kSmall) {
    double series = 0.0;
    for (int n = 14; n >= 2; --n) {
      series = (1.0 + series) * x / n;
    }
    // The sum is x (1 + series).
    return x + x * series;
  }
  if (!(x <= kMost)) {
    return std::isnan(x) ? x : kInfinity;
  }
  constexpr double kNothing = -40.0;  // e to this is less than half of 1's last place
  if (x < kNothing) {
    return -1.0;
  }
  const Power power = power_of_e(x, 0.0);
  const Pair less_one = sum(scaled(power.value.high, power.k), -1.0);
  return less_one.high + (less_one.low + scaled(power.value.low, power.k));
}

double log(double x) {
  if (!has_log(x)) {
    return log_at_edge(x);
  }
  const auto [f, k] = split(x);
  // ln (1 + f) = f − f²/2 + s (f²/2 + 2z/3 + 2z²/5 …), of which f is exact.
  const double s = f / (2.0 + f);
  const double z = s * s;
  const double series = 2.0 * z * (1.0 / 3 + z * (1.0 / 5 + z * last_terms(z)));
  const double half_square = 0.5 * f * f;
  return k * kLn2High - ((half_square - (s * (half_square + series) + k * kLn2Low.high)) - f);
}

double log2(double x) { return log_to_base(x, kPerLn2); }

double log10(double x) { return log_to_base(x, kPerLn10); }

double pow(double x, double y) {
  if (y == 0.0 || x == 1.0) {
    return 1.0;
  }
  if (!has_log(x)) {
    if (x == 0.0 || x == kInfinity) {
      return (x == 0.0) == (y > 0.0) ? 0.0 : kInfinity;
    }
    return kNaN;
  }
  const Pair ln = log_of(x);
  // Beyond this the result is 0 or infinite, and the product might not be a number.
  constexpr double kFar = 800.0;
  const double about = y * ln.high;
  return std::abs(about) < kFar ? exp(product({y, 0.0}, ln)) : exp(about);
}

double tanh(double x) {
  constexpr double kOne = 20.0;  // from here on tanh is 1 but for less than half of its last place
  if (std::abs(x) > kOne) {
    return std::copysign(1.0, x);
  }
  const double grown = expm1(2.0 * std::abs(x));
  return std::copysign(grown / (grown + 2.0), x);
}

}  // namespace unflex::math
