#include "pressed_filament.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace unflex::verify {
namespace {

using dynamics::HotendPressure;
using enum dynamics::PressureShape;

TEST(PressedFilament, ComesOutAtOnceWithoutPressure) {
  PressedFilament hotend(HotendPressure{});
  EXPECT_DOUBLE_EQ(hotend.push(0.01, 0.3), 0.3);
  EXPECT_DOUBLE_EQ(hotend.flow_mm_s(), 30.0);
}

// A step of the extruder's speed from 0 to r: q = r (1 − e^(−t/K)), V = r (t − K (1 − e^(−t/K))).
TEST(PressedFilament, FollowsAStepExponentially) {
  constexpr double kAdvance_s = 0.04;
  constexpr double kRate_mm_s = 5.0;
  PressedFilament hotend(HotendPressure{.advance_s = kAdvance_s});
  double out_mm = 0.0;
  double t = 0.0;
  for (const double part_s : {1e-3, 7e-3, 0.02, 0.1}) {
    out_mm += hotend.push(part_s, kRate_mm_s * part_s);
    t += part_s;
    const double grown = 1.0 - std::exp(-t / kAdvance_s);
    EXPECT_NEAR(hotend.flow_mm_s(), kRate_mm_s * grown, 1e-12);
    EXPECT_NEAR(out_mm, kRate_mm_s * (t - kAdvance_s * grown), 1e-12);
  }
}

TEST(PressedFilament, ComesOutLaterByTheDeadTime) {
  const HotendPressure prompt{.advance_s = 0.03};
  HotendPressure late = prompt;
  late.dead_time_s = 4e-3;
  PressedFilament one(prompt);
  PressedFilament other(late);
  EXPECT_EQ(other.push(4e-3, 0.1), 0.0);
  EXPECT_NEAR(other.push(3e-3, -0.2), one.push(3e-3, 0.075), 1e-12);
  EXPECT_NEAR(other.push(1e-3, 0.0), one.push(1e-3, 0.025), 1e-12);
  EXPECT_NEAR(other.push(3e-3, 0.0), one.push(3e-3, -0.2), 1e-12);
}

class Random : public ::testing::TestWithParam<dynamics::PressureShape> {};

// What has been pushed is pressed together or has come out; finer stretches come to the same flow.
TEST_P(Random, KeepsFilamentAndAgreesWithFineStretches) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> of(-0.3, 1.0);
  const HotendPressure model{.shape = GetParam(),
                             .advance_s = 0.03,
                             .offset_mm = 0.05,
                             .knee_mm_s = 4.0,
                             .second_advance_s = 0.01};
  PressedFilament coarse(model);
  PressedFilament fine(model);
  double pushed_mm = 0.0;
  double out_mm = 0.0;
  for (int i = 0; i < 300; ++i) {
    const double part_mm = 0.01 * of(random);
    pushed_mm += part_mm;
    out_mm += coarse.push(1e-3, part_mm);
    for (int k = 0; k < 50; ++k) {
      static_cast<void>(fine.push(2e-5, part_mm / 50.0));
    }
    EXPECT_NEAR(pushed_mm, out_mm + model.pressed_mm(coarse.flow_mm_s()), 1e-12);
    EXPECT_NEAR(coarse.flow_mm_s(), fine.flow_mm_s(), GetParam() == two_slopes ? 0.2 : 0.02);
  }
}

INSTANTIATE_TEST_SUITE_P(All, Random, ::testing::Values(linear, two_slopes, tanh, reciprocal));

TEST(PressedFilament, KeepsWhatIsPressedWhenThePressureBecomesAnother) {
  PressedFilament hotend(HotendPressure{.advance_s = 0.04});
  static_cast<void>(hotend.push(1.0, 6.0));
  hotend.set({.shape = tanh, .advance_s = 0.02, .offset_mm = 0.1, .knee_mm_s = 3.0});
  const HotendPressure now{.shape = tanh, .advance_s = 0.02, .offset_mm = 0.1, .knee_mm_s = 3.0};
  EXPECT_NEAR(now.pressed_mm(hotend.flow_mm_s()), 0.24, 1e-9);
}

}  // namespace
}  // namespace unflex::verify
