// The shaped base of the second stage.
#include "unflex/compensate/second_stage.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "unflex/dynamics/shapers.hpp"

namespace unflex::compensate {
namespace {

constexpr double kPeriod_s = 1e-3;

// From rest to rest: b = 10 (u − sin 2πu / 2π) mm with u = t/T.
dynamics::AxisTrajectory rise(std::size_t nodes, double factor) {
  dynamics::AxisTrajectory base;
  const double whole_s = static_cast<double>(nodes - 1) * kPeriod_s;
  for (std::size_t k = 0; k < nodes; ++k) {
    const double turn = 2.0 * M_PI * static_cast<double>(k) / static_cast<double>(nodes - 1);
    base.position_mm.push_back(factor * 10.0 * (turn - std::sin(turn)) / (2.0 * M_PI));
    base.velocity_mm_s.push_back(factor * 10.0 * (1.0 - std::cos(turn)) / whole_s);
    base.accel_mm_s2.push_back(factor * 20.0 * M_PI * std::sin(turn) / (whole_s * whole_s));
  }
  return base;
}

dynamics::BaseTrajectory rise_of_both() { return {{rise(101, 1.0), rise(101, -0.5)}, kPeriod_s}; }

Setup shaped_setup() {
  Setup setup;
  setup.x.pulses = dynamics::shaper_pulses(dynamics::ShaperKind::zv, 110.0, 0.05).value();
  setup.y.pulses = dynamics::shaper_pulses(dynamics::ShaperKind::zvd, 80.0, 0.05).value();
  return setup;
}

// How far an axis with this mode swings about its place once the base rests.
double left_um(const dynamics::AxisTrajectory& base, double freq_hz, double damping_ratio) {
  const dynamics::FlexibleAxis axis = dynamics::from_frequency(freq_hz, damping_ratio);
  dynamics::NozzleState nozzle = axis.riding(base.position_mm.front());
  constexpr int kParts = 20;
  for (std::size_t k = 0; k + 1 < base.position_mm.size(); ++k) {
    for (int i = 0; i < kParts; ++i) {
      const double h = kPeriod_s / kParts;
      const auto from = dynamics::between(base, k, i * h, kPeriod_s);
      const auto middle = dynamics::between(base, k, (i + 0.5) * h, kPeriod_s);
      nozzle =
          exact_step(axis, nozzle, {from.position_mm, from.velocity_mm_s, middle.accel_mm_s2}, h);
    }
  }
  return 1e3 * std::hypot(nozzle.position() - base.position_mm.back(),
                          nozzle.velocity() / axis.main_rad_s());
}

TEST(SecondStage, LeavesTheModeAtRest) {
  const dynamics::BaseTrajectory base = rise_of_both();
  const compensate::Setup setup = shaped_setup();
  const std::size_t more = nodes_of_shaping(setup, kPeriod_s);
  const dynamics::BaseTrajectory made = shaped(base, setup, more, more);
  EXPECT_GT(left_um(base.x, 110.0, 0.05), 1.0);
  EXPECT_LT(left_um(made.x, 110.0, 0.05), 0.02 * left_um(base.x, 110.0, 0.05));
  EXPECT_LT(left_um(made.y, 80.0, 0.05), 0.02 * left_um(base.y, 80.0, 0.05));
}

TEST(SecondStage, BeginsAndEndsWhereTheBaseDoes) {
  const dynamics::BaseTrajectory base = rise_of_both();
  const compensate::Setup setup = shaped_setup();
  const std::size_t more = nodes_of_shaping(setup, kPeriod_s);
  const dynamics::BaseTrajectory made = shaped(base, setup, more, more);
  EXPECT_EQ(made.nodes(), base.nodes() + 2 * more);
  EXPECT_NEAR(made.x.position_mm.front(), 0.0, 1e-12);
  EXPECT_NEAR(made.x.position_mm.back(), 10.0, 1e-12);
  EXPECT_NEAR(made.y.position_mm.back(), -5.0, 1e-12);
  EXPECT_NEAR(made.x.velocity_mm_s.front(), 0.0, 1e-9);
  EXPECT_NEAR(made.x.velocity_mm_s.back(), 0.0, 1e-9);
}

TEST(SecondStage, KeepsEvenMotionAsItIs) {
  // In the middle of a long even motion, at nodes that no pulse reaches beyond.
  dynamics::AxisTrajectory even;
  for (int k = 0; k < 100; ++k) {
    even.position_mm.push_back(0.1 * k);
    even.velocity_mm_s.push_back(100.0);
    even.accel_mm_s2.push_back(0.0);
  }
  const dynamics::BaseTrajectory made = shaped({{even, even}, kPeriod_s}, shaped_setup(), 0, 0);
  for (std::size_t k = 20; k < 80; ++k) {
    EXPECT_NEAR(made.x.position_mm[k], even.position_mm[k], 1e-12);
    EXPECT_NEAR(made.y.position_mm[k], even.position_mm[k], 1e-12);
  }
}

TEST(SecondStage, KeepsTheLimitsOfTheBase) {
  const dynamics::BaseTrajectory base = rise_of_both();
  compensate::Setup setup = shaped_setup();
  const auto highest = [](const std::vector<double>& values) {
    return std::abs(
        *std::ranges::max_element(values, {}, [](double value) { return std::abs(value); }));
  };
  const dynamics::BaseTrajectory made = shaped(base, setup, 20, 20);
  EXPECT_LE(highest(made.x.velocity_mm_s), highest(base.x.velocity_mm_s));
  EXPECT_LE(highest(made.x.accel_mm_s2), highest(base.x.accel_mm_s2));
  EXPECT_LE(highest(made.y.accel_mm_s2), highest(base.y.accel_mm_s2));
}

TEST(SecondStage, ShapesAxesThatShareMotorsAlike) {
  const dynamics::BaseTrajectory base = rise_of_both();
  compensate::Setup setup = shaped_setup();
  setup.shares_motors = true;
  const std::size_t more = nodes_of_shaping(setup, kPeriod_s);
  const dynamics::BaseTrajectory made = shaped(base, setup, more, more);
  for (std::size_t k = 0; k < made.nodes(); ++k) {
    EXPECT_NEAR(made.y.position_mm[k], -0.5 * made.x.position_mm[k], 1e-12);
  }
  EXPECT_LT(left_um(made.x, 110.0, 0.05), 0.02 * left_um(base.x, 110.0, 0.05));
  EXPECT_LT(left_um(made.y, 80.0, 0.05), 0.02 * left_um(base.y, 80.0, 0.05));
}

TEST(SecondStage, IsNoneWithoutPulses) {
  const dynamics::BaseTrajectory base = rise_of_both();
  EXPECT_EQ(nodes_of_shaping(compensate::Setup{}, kPeriod_s), 0U);
  EXPECT_EQ(shaped(base, compensate::Setup{}, 0, 0).x.position_mm, base.x.position_mm);
}

}  // namespace
}  // namespace unflex::compensate
