#include "unflex/core/math.hpp"

#include <gtest/gtest.h>
#include <mpfr.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "unflex/core/sha256.hpp"

namespace unflex {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// Arguments that are the same with every standard library.
class Arguments {
 public:
  double within(double low, double high) {
    return low + (high - low) * static_cast<double>(random_() >> 11U) * 0x1p-53;
  }
  // ±2ᵉ (1 … 2) for whole e.
  double of_size(int low, int high) {
    const int e = low + static_cast<int>(random_() % static_cast<std::uint64_t>(high - low));
    const double value = std::ldexp(within(1.0, 2.0), e);
    return (random_() & 1U) != 0 ? value : -value;
  }

 private:
  std::mt19937_64 random_{1};
};

class Exact {
 public:
  explicit Exact(double value = 0.0) {
    mpfr_init2(value_, 400);
    mpfr_set_d(value_, value, MPFR_RNDN);
  }
  ~Exact() { mpfr_clear(value_); }
  Exact(const Exact&) = delete;
  Exact& operator=(const Exact&) = delete;

  mpfr_t& get() { return value_; }

  // How many units in its last place `got` is away.
  double ulps_to(double got) {
    const double nearest = mpfr_get_d(value_, MPFR_RNDN);
    if (nearest == 0.0 || !std::isfinite(nearest) || !std::isfinite(got)) {
      return got == nearest ? 0.0 : kInfinity;
    }
    Exact off(got);
    mpfr_sub(off.value_, off.value_, value_, MPFR_RNDN);
    const int least = std::numeric_limits<double>::min_exponent;
    const int unit = std::max(std::ilogb(nearest) + 1, least) - 53;
    return std::abs(mpfr_get_d(off.value_, MPFR_RNDN)) / std::ldexp(1.0, unit);
  }

 private:
  mpfr_t value_;
};

using Unary = double (*)(double);
using ExactUnary = int (*)(mpfr_t, mpfr_srcptr, mpfr_rnd_t);
using Binary = double (*)(double, double);
using ExactBinary = int (*)(mpfr_t, mpfr_srcptr, mpfr_srcptr, mpfr_rnd_t);

template <class Draw>
double worst_ulps(Unary function, ExactUnary exact, const Draw& draw) {
  Arguments arguments;
  double worst = 0.0;
  for (int i = 0; i < 20'000; ++i) {
    const double x = draw(arguments);
    Exact value(x);
    exact(value.get(), value.get(), MPFR_RNDN);
    worst = std::max(worst, value.ulps_to(function(x)));
  }
  return worst;
}

template <class Draw>
double worst_ulps_of_two(Binary function, ExactBinary exact, const Draw& draw) {
  Arguments arguments;
  double worst = 0.0;
  for (int i = 0; i < 20'000; ++i) {
    const auto [x, y] = draw(arguments);
    Exact value(x);
    Exact second(y);
    exact(value.get(), value.get(), second.get(), MPFR_RNDN);
    worst = std::max(worst, value.ulps_to(function(x, y)));
  }
  return worst;
}

auto sizes(int low, int high) {
  return [=](Arguments& from) { return from.of_size(low, high); };
}
auto range(double low, double high) {
  return [=](Arguments& from) { return from.within(low, high); };
}

TEST(Math, PowersOfEAreWithinAUnitInTheLastPlace) {
  EXPECT_LE(worst_ulps(math::exp, mpfr_exp, range(-745.0, 709.7)), 1.0);
  EXPECT_LE(worst_ulps(math::exp, mpfr_exp, sizes(-60, 3)), 1.0);
  EXPECT_LE(worst_ulps(math::exp2, mpfr_exp2, range(-1074.0, 1023.9)), 1.0);
  EXPECT_LE(worst_ulps(math::expm1, mpfr_expm1, sizes(-60, 9)), 1.0);
  EXPECT_LE(worst_ulps(math::expm1, mpfr_expm1, range(-0.7, 0.7)), 1.0);
  EXPECT_LE(worst_ulps(math::tanh, mpfr_tanh, sizes(-60, 5)), 3.0);
}

TEST(Math, LogarithmsAreWithinAUnitInTheLastPlace) {
  const auto all = [](Arguments& from) { return std::abs(from.of_size(-1074, 1023)); };
  for (const auto& [function, exact] : {std::pair<Unary, ExactUnary>{math::log, mpfr_log},
                                        {math::log2, mpfr_log2},
                                        {math::log10, mpfr_log10}}) {
    EXPECT_LE(worst_ulps(function, exact, all), 1.0);
    EXPECT_LE(worst_ulps(function, exact, range(0.5, 2.0)), 1.0);
    EXPECT_LE(worst_ulps(function, exact, range(1.0 - 1e-9, 1.0 + 1e-9)), 1.0);
  }
}

TEST(Math, PowersAreWithinAUnitInTheLastPlace) {
  EXPECT_LE(worst_ulps_of_two(math::pow, mpfr_pow,
                              [](Arguments& from) {
                                return std::pair{from.within(0.0, 10.0), from.within(-20.0, 20.0)};
                              }),
            1.0);
  EXPECT_LE(worst_ulps_of_two(math::pow, mpfr_pow,
                              [](Arguments& from) {
                                const double x = std::abs(from.of_size(-40, 40));
                                return std::pair{x, from.within(-700.0, 700.0) / std::log(x)};
                              }),
            1.0);
}

TEST(Math, SineAndCosineAreWithinAUnitInTheLastPlace) {
  const auto near_quarters = [](Arguments& from) {
    return std::round(from.within(-1e9, 1e9)) * 1.5707963267948966;
  };
  for (const auto& [function, exact] :
       {std::pair<Unary, ExactUnary>{math::sin, mpfr_sin}, {math::cos, mpfr_cos}}) {
    EXPECT_LE(worst_ulps(function, exact, sizes(-60, 31)), 1.0);
    EXPECT_LE(worst_ulps(function, exact, range(-7.0, 7.0)), 1.0);
    EXPECT_LE(worst_ulps(function, exact, near_quarters), 1.0);
  }
  EXPECT_NEAR(math::sin(1e12), std::sin(1e12), 1e-3);
}

TEST(Math, AnglesAndDistancesAreWithinAUnitInTheLastPlace) {
  const auto near = [](Arguments& from) {
    return std::pair{from.of_size(-10, 10), from.of_size(-10, 10)};
  };
  const auto far = [](Arguments& from) {
    return std::pair{from.of_size(-1000, 1000), from.of_size(-1000, 1000)};
  };
  for (const auto& [function, exact] :
       {std::pair<Binary, ExactBinary>{math::atan2, mpfr_atan2}, {math::hypot, mpfr_hypot}}) {
    EXPECT_LE(worst_ulps_of_two(function, exact, near), 1.0);
    EXPECT_LE(worst_ulps_of_two(function, exact, far), 1.0);
  }
  EXPECT_LE(worst_ulps(math::atan, mpfr_atan, sizes(-60, 60)), 1.0);
}

TEST(Math, WholePowersOfTenAreExact) {
  for (int n = 0; n <= 22; ++n) {
    const double power = std::stod("1e" + std::to_string(n));
    EXPECT_EQ(math::pow(10.0, n), power);
    EXPECT_EQ(math::log10(power), n);
  }
  EXPECT_EQ(math::exp2(10.0), 1024.0);
  EXPECT_EQ(math::log2(1024.0), 10.0);
}

TEST(Math, KnowsTheEdgesOfItsFunctions) {
  EXPECT_EQ(math::exp(-kInfinity), 0.0);
  EXPECT_EQ(math::exp(-800.0), 0.0);
  EXPECT_EQ(math::exp(710.0), kInfinity);
  EXPECT_EQ(math::exp2(-5000.0), 0.0);
  EXPECT_EQ(math::exp2(5000.0), kInfinity);
  EXPECT_EQ(math::expm1(-kInfinity), -1.0);
  EXPECT_EQ(math::expm1(1000.0), kInfinity);
  EXPECT_EQ(math::log(0.0), -kInfinity);
  EXPECT_EQ(math::log10(kInfinity), kInfinity);
  EXPECT_TRUE(std::isnan(math::log(-1.0)));
  EXPECT_EQ(math::pow(0.0, 0.0), 1.0);
  EXPECT_EQ(math::pow(0.0, 2.0), 0.0);
  EXPECT_EQ(math::pow(0.0, -2.0), kInfinity);
  EXPECT_EQ(math::pow(kInfinity, 2.0), kInfinity);
  EXPECT_EQ(math::pow(1.0, kInfinity), 1.0);
  EXPECT_EQ(math::pow(2.0, -kInfinity), 0.0);
  EXPECT_TRUE(std::isnan(math::pow(-2.0, 2.0)));
  EXPECT_EQ(math::tanh(100.0), 1.0);
  EXPECT_EQ(math::tanh(-100.0), -1.0);
  EXPECT_TRUE(std::signbit(math::sin(-0.0)));
  EXPECT_EQ(math::cos(0.0), 1.0);
  EXPECT_TRUE(std::isnan(math::sin(kInfinity)));
  EXPECT_EQ(math::hypot(3.0, -4.0), 5.0);
  EXPECT_EQ(math::hypot(0.0, 0.0), 0.0);
  EXPECT_EQ(math::hypot(kNaN, -kInfinity), kInfinity);
  for (const Unary function : {math::exp, math::exp2, math::expm1, math::log, math::log2,
                               math::log10, math::tanh, math::sin, math::cos, math::atan}) {
    EXPECT_TRUE(std::isnan(function(kNaN)));
  }
  EXPECT_TRUE(std::isnan(math::pow(kNaN, 2.0)));
  EXPECT_TRUE(std::isnan(math::atan2(kNaN, 2.0)));
  EXPECT_TRUE(std::isnan(math::hypot(1.0, kNaN)));
}

TEST(Math, AnglesGoAllAround) {
  for (const double y : {0.0, -0.0, 1.0, -1.0, 1e-320, kInfinity, -kInfinity}) {
    for (const double x : {0.0, 1.0, -1.0, 1e300, kInfinity, -kInfinity}) {
      EXPECT_DOUBLE_EQ(math::atan2(y, x), std::atan2(y, x)) << y << ' ' << x;
    }
  }
}

// This holds on every processor and system. Whoever changes a function changes this, and the bytes
// of emitted files with it.
TEST(Math, ResultsAreTheSameToTheBit) {
  Arguments arguments;
  std::string bits;
  const auto add = [&](double value) {
    const auto whole = std::bit_cast<std::uint64_t>(value);
    for (unsigned byte = 0; byte < 8; ++byte) {
      bits += static_cast<char>((whole >> (8 * byte)) & 0xFFU);
    }
  };
  for (int i = 0; i < 2000; ++i) {
    const double x = arguments.of_size(-20, 9);
    const double y = arguments.of_size(-20, 9);
    for (const Unary function :
         {math::exp, math::exp2, math::expm1, math::tanh, math::sin, math::cos, math::atan}) {
      add(function(x));
    }
    for (const Unary function : {math::log, math::log2, math::log10}) {
      add(function(std::abs(x)));
    }
    add(math::pow(std::abs(x), arguments.within(-20.0, 20.0)));
    add(math::atan2(y, x));
    add(math::hypot(x, y));
  }
  EXPECT_EQ(sha256(bits), "71f718fc769748acb522b01bae608ab4477db91c63e724a516c14c514f910650");
}

}  // namespace
}  // namespace unflex
