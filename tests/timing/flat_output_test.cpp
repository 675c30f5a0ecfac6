#include "flat_output.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <complex>
#include <type_traits>

namespace unflex::timing {
namespace {

using Complex = std::complex<double>;

constexpr dynamics::Mode kMode{.omega_rad_s = 250.0, .zeta = 0.07};
constexpr double kUnit_s = 1.6e-3;
// Rates of e^{st}, per second: growing, swinging, both.
const Complex kRates[] = {{120.0, 0.0}, {0.0, 200.0}, {-40.0, 310.0}, {90.0, -500.0}};

// From base to nozzle: (1 + a s)/(1 + a s + κ s²).
Complex transfer(double omega_rad_s, double zeta, Complex s) {
  const Complex damping = 2.0 * zeta / omega_rad_s * s;
  return (1.0 + damping) / (1.0 + damping + s * s / (omega_rad_s * omega_rad_s));
}

// What the factors make of e^{st} at t = 0.
template <std::size_t K>
Complex of(const std::array<double, K>& factors, Complex s) {
  Complex sum = 0.0;
  Complex power = 1.0;
  for (const double factor : factors) {
    sum += factor * power;
    power *= s * kUnit_s;
  }
  return sum;
}

template <typename Count>
class FlatOutputOf : public ::testing::Test {
 protected:
  const FlatOutput<Count::value> flat = flat_output<Count::value>(kMode, kUnit_s);
};

using Counts = ::testing::Types<std::integral_constant<int, 5>, std::integral_constant<int, 7>>;
TYPED_TEST_SUITE(FlatOutputOf, Counts, );

TYPED_TEST(FlatOutputOf, AnAxisHasItsTransferFunction) {
  for (const Complex s : kRates) {
    const Complex ratio = of(this->flat.nozzle, s) / of(this->flat.base, s);
    EXPECT_LT(std::abs(ratio - transfer(kMode.omega_rad_s, kMode.zeta, s)), 1e-12) << s;
  }
}

TYPED_TEST(FlatOutputOf, AnAxisObeysItsEquationOfMotion) {
  const double damping = kMode.damping_per_s() * kUnit_s;
  const double stiffness = kMode.stiffness_per_s2() * kUnit_s * kUnit_s;
  for (const Complex s : kRates) {
    const Complex p = of(this->flat.nozzle, s);
    const Complex v = of(this->flat.nozzle_speed, s);
    const Complex b = of(this->flat.base, s);
    const Complex b_speed = of(this->flat.base_speed, s);
    EXPECT_LT(std::abs(v * s * kUnit_s - damping * (b_speed - v) - stiffness * (b - p)),
              1e-12 * std::abs(b))
        << s;
  }
}

TYPED_TEST(FlatOutputOf, AnAxisHasTheSpeedsOfItsPlaces) {
  for (const Complex s : kRates) {
    const Complex b = of(this->flat.base, s);
    const Complex by_unit = s * kUnit_s;
    EXPECT_LT(std::abs(of(this->flat.nozzle_speed, s) - by_unit * of(this->flat.nozzle, s)), 1e-12);
    EXPECT_LT(std::abs(of(this->flat.base_speed, s) - by_unit * b), 1e-12);
    EXPECT_LT(std::abs(of(this->flat.base_accel, s) - by_unit * by_unit * b), 1e-12);
  }
}

TYPED_TEST(FlatOutputOf, AnAxisAtRestIsAtItsPlace) {
  EXPECT_EQ(of(this->flat.nozzle, 0.0), 1.0);
  EXPECT_EQ(of(this->flat.base, 0.0), 1.0);
}

TEST(FlatOutput, TellsHowTheNozzleStraysAtAnotherFrequencyOnTheSameBase) {
  const FlatOutput<7> flat = flat_output<7>(kMode, kUnit_s);
  constexpr double kStep = 1e-4;
  for (const Complex s : kRates) {
    const Complex base = of(flat.base, s);
    const Complex slope = base *
                          (transfer(kMode.omega_rad_s * std::exp(kStep), kMode.zeta, s) -
                           transfer(kMode.omega_rad_s * std::exp(-kStep), kMode.zeta, s)) /
                          (2.0 * kStep);
    EXPECT_LT(std::abs(of(flat.sensitivity, s) - slope), 1e-6 * std::abs(slope)) << s;
  }
}

}  // namespace
}  // namespace unflex::timing
