// The base's limits hold everywhere, between the nodes too.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "playback.hpp"

namespace unflex::compensate {
namespace {

using testing::planner_limits;
using testing::setup_for;
using testing::x_window;

// The extremes over 50 points per interval.
struct Extremes {
  double velocity = 0.0;
  double accel = 0.0;
  double jerk = 0.0;
  double low = 1e9;
  double high = -1e9;
};

Extremes extremes(const dynamics::AxisTrajectory& base, double h) {
  Extremes result;
  for (std::size_t k = 0; k + 1 < base.position_mm.size(); ++k) {
    for (int i = 0; i <= 50; ++i) {
      const dynamics::AxisMotion motion = dynamics::between(base, k, h * i / 50.0, h);
      result.velocity = std::max(result.velocity, std::abs(motion.velocity_mm_s));
      result.accel = std::max(result.accel, std::abs(motion.accel_mm_s2));
      result.low = std::min(result.low, motion.position_mm);
      result.high = std::max(result.high, motion.position_mm);
    }
    result.jerk =
        std::max(result.jerk, std::abs(base.accel_mm_s2[k + 1] - base.accel_mm_s2[k]) / h);
  }
  return result;
}

Extremes solve(const AxisWindow& window) {
  const Result<AxisSolution> solution = make_ipopt_engine()->solve(window);
  EXPECT_TRUE(solution.has_value()) << to_string(solution.error());
  return solution ? extremes(solution->base, window.period_s) : Extremes{};
}

// Full stops at 5000 mm/s², for which the base would need more than any limit below.
AxisWindow stops(double base_accel) {
  const auto moves = testing::plan({{50.0, 0.0}, {60.0, 0.0}, {52.0, 0.0}, {58.0, 0.0}},
                                   planner_limits(100.0, 5000.0, 0.0));
  return x_window(moves, setup_for({}, base_accel));
}

TEST(BaseLimits, HoldForAccelerationAndAreUsed) {
  for (const double limit : {8e3, 1e4, 2e4}) {
    const Extremes found = solve(stops(limit));
    EXPECT_LE(found.accel, limit * (1.0 + 2e-6));
    EXPECT_GE(found.accel, limit * (1.0 - 1e-3));
  }
}

TEST(BaseLimits, HoldForVelocityBetweenNodes) {
  AxisWindow window = stops(2e4);
  const double free = solve(window).velocity;
  EXPECT_GT(free, 103.0);
  for (const double limit : {102.0, 95.0}) {
    window.limits.max_velocity_mm_s = limit;
    const Extremes found = solve(window);
    EXPECT_LE(found.velocity, limit * (1.0 + 2e-6));
    EXPECT_GE(found.velocity, limit - 2e4 * window.period_s / 4.0 - 1e-3);
    EXPECT_LE(found.accel, 2e4 * (1.0 + 2e-6));
  }
}

TEST(BaseLimits, HoldForJerkAndAreUsed) {
  AxisWindow window = stops(2e4);
  EXPECT_GT(solve(window).jerk, 1e7);
  for (const double limit : {1e7, 5e6}) {
    window.limits.max_jerk_mm_s3 = limit;
    const Extremes found = solve(window);
    EXPECT_LE(found.jerk, limit * (1.0 + 1e-5));
    EXPECT_GE(found.jerk, limit * (1.0 - 1e-3));
    EXPECT_LE(found.accel, 2e4 * (1.0 + 2e-6));
  }
}

TEST(BaseLimits, HoldForTheTravelBetweenNodes) {
  AxisWindow window = stops(2e4);
  ASSERT_GT(solve(window).high, 59.93);
  for (const double limit : {59.93, 59.9, 59.5}) {
    window.limits.max_position_mm = limit;
    const Extremes found = solve(window);
    EXPECT_LE(found.high, limit + 1.1e-5);
    EXPECT_GE(found.high, limit - 5e-3);
    EXPECT_LE(found.accel, 2e4 * (1.0 + 2e-6));
  }
}

TEST(BaseLimits, HoldForTheTravelOfAMirroredRun) {
  AxisWindow window = stops(2e4);
  for (double& r : window.reference_mm) {
    r = -r;
  }
  window.start = AxisWindow::Start{{-50.0, 0.0}, -50.0};
  window.end_base_mm = -*window.end_base_mm;
  window.limits.min_position_mm = -59.9;
  const Extremes found = solve(window);
  EXPECT_GE(found.low, -59.9 - 1.1e-5);
  EXPECT_LE(found.low, -59.9 + 5e-3);
}

TEST(BaseLimits, HoldForTheTravelWhereABaseAtItsEndIsPulledOutwards) {
  // The nozzle starts beyond the base, which rests at the end of the travel and may not follow it.
  AxisWindow window = stops(2e4);
  window.limits.min_position_mm = 50.0;
  window.start->nozzle = {49.9, 0.0};
  const Extremes found = solve(window);
  EXPECT_GE(found.low, 50.0 - 1.1e-5);
}

TEST(BaseLimits, HoldAllAtOnce) {
  AxisWindow window = stops(1.5e4);
  window.limits.max_velocity_mm_s = 101.0;
  window.limits.max_jerk_mm_s3 = 1.2e7;
  window.limits.max_position_mm = 59.9;
  const Extremes found = solve(window);
  EXPECT_LE(found.accel, 1.5e4 * (1.0 + 2e-6));
  EXPECT_LE(found.velocity, 101.0 * (1.0 + 2e-6));
  EXPECT_LE(found.jerk, 1.2e7 * (1.0 + 1e-5));
  EXPECT_LE(found.high, 59.9 + 1.1e-5);
}

}  // namespace
}  // namespace unflex::compensate
