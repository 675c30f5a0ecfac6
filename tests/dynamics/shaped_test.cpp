#include "unflex/dynamics/shaped.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace unflex::dynamics {
namespace {

// Pulses whose mean delay is 0 leave an even motion as it is, and slow a bend by their spread.
TEST(Shaped, LeavesAnEvenMotionAndSpreadsABend) {
  const ShaperPulses pulses = {{-0.01, 0.6}, {0.015, 0.4}};
  const auto parabola = [](std::size_t, double t) { return BaseSegment{t * t, 2.0 * t, 2.0}; };
  const BaseSegment bend = shaped_at<BaseSegment>(pulses, 0.3, parabola);
  const double spread_s2 = 0.6 * 0.01 * 0.01 + 0.4 * 0.015 * 0.015;
  EXPECT_NEAR(bend.position, 0.09 + spread_s2, 1e-15);
  EXPECT_NEAR(bend.velocity, 0.6, 1e-15);
  EXPECT_NEAR(bend.acceleration, 2.0, 1e-15);
}

TEST(Shaped, AddsToWhatThereIs) {
  const ShaperPulses pulses = {{0.0, 0.25}, {0.1, 0.75}};
  const auto step = [](std::size_t pulse, double t) {
    return NozzleMotion{t >= 0.0 ? 1.0 : 0.0, static_cast<double>(pulse)};
  };
  const NozzleMotion sum = shaped_at(pulses, 0.05, step, NozzleMotion{10.0, 0.0});
  EXPECT_DOUBLE_EQ(sum.position, 10.25);
  EXPECT_DOUBLE_EQ(sum.velocity, 0.75);
}

}  // namespace
}  // namespace unflex::dynamics
