#include "unflex/dynamics/hotend_pressure.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace unflex::dynamics {
namespace {

using enum PressureShape;

TEST(HotendPressure, PressesWhatItsShapeSays) {
  const HotendPressure line{.advance_s = 0.04};
  EXPECT_DOUBLE_EQ(line.pressed_mm(5.0), 0.2);
  const HotendPressure two{
      .shape = two_slopes, .advance_s = 0.04, .knee_mm_s = 2.0, .second_advance_s = 0.01};
  EXPECT_DOUBLE_EQ(two.pressed_mm(1.0), 0.04);
  EXPECT_DOUBLE_EQ(two.pressed_mm(5.0), 0.04 * 2.0 + 0.01 * 3.0);
  const HotendPressure bent{.shape = tanh, .advance_s = 0.02, .offset_mm = 0.1, .knee_mm_s = 3.0};
  EXPECT_DOUBLE_EQ(bent.pressed_mm(3.0), 0.02 * 3.0 + 0.1 * std::tanh(1.0));
  const HotendPressure other{
      .shape = reciprocal, .advance_s = 0.02, .offset_mm = 0.1, .knee_mm_s = 3.0};
  EXPECT_DOUBLE_EQ(other.pressed_mm(3.0), 0.02 * 3.0 + 0.05);
}

class Shapes : public ::testing::TestWithParam<PressureShape> {};

TEST_P(Shapes, AreOddAndHaveTheSlopeThatTheySay) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> of(0.1, 8.0);
  for (int i = 0; i < 100; ++i) {
    const HotendPressure hotend{.shape = GetParam(),
                                .advance_s = 0.01 * of(random),
                                .offset_mm = 0.02 * of(random),
                                .knee_mm_s = of(random),
                                .second_advance_s = 0.005 * of(random)};
    const double q = of(random);
    const double h = 1e-5;
    if (std::abs(q - hotend.knee_mm_s) > h) {
      const double slope = (hotend.pressed_mm(q + h) - hotend.pressed_mm(q - h)) / (2.0 * h);
      EXPECT_NEAR(hotend.slope_s(q), slope, 1e-8);
    }
    EXPECT_EQ(hotend.pressed_mm(-q), -hotend.pressed_mm(q));
    EXPECT_EQ(hotend.slope_s(-q), hotend.slope_s(q));
    EXPECT_NEAR(hotend.scaled(1.2).pressed_mm(q), 1.2 * hotend.pressed_mm(q), 1e-12);
  }
}

INSTANTIATE_TEST_SUITE_P(All, Shapes, ::testing::Values(linear, two_slopes, tanh, reciprocal));

}  // namespace
}  // namespace unflex::dynamics
