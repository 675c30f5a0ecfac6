#include "bounded_plan.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "../compensate/playback.hpp"

namespace unflex::timing {
namespace {

using compensate::testing::plan;
using compensate::testing::planner_limits;

std::vector<planner::PlannedMove> straight(std::size_t moves, double length_mm) {
  std::vector<compensate::testing::Point> points;
  for (std::size_t i = 0; i <= moves; ++i) {
    points.push_back({static_cast<double>(i) * length_mm, 0.0});
  }
  return plan(points, planner_limits(100.0, 1000.0, 5.0));
}

TEST(BoundedPlan, IsTheTrapezoidOfOneMove) {
  const auto path = straight(1, 10.0);
  const std::vector<MoveBounds> bounds = {{.speed_mm_s = 50.0, .accel_mm_s2 = 1000.0}};
  const auto result = bounded_plan(path, bounds, std::vector{0.0, 0.0});
  // 50 ms up and down, 1.25 mm each, and 7.5 mm at 50 mm/s.
  EXPECT_NEAR(result[0].accel_s, 0.05, 1e-12);
  EXPECT_NEAR(result[0].cruise_s, 0.15, 1e-12);
  EXPECT_NEAR(result[0].decel_s, 0.05, 1e-12);
}

TEST(BoundedPlan, IsATriangleWhereTheSpeedIsNotReached) {
  const auto path = straight(1, 2.0);
  const std::vector<MoveBounds> bounds = {{.speed_mm_s = 200.0, .accel_mm_s2 = 800.0}};
  const auto result = bounded_plan(path, bounds, std::vector{0.0, 0.0});
  // 2 √(L/a)
  EXPECT_NEAR(result[0].duration_s(), 0.1, 1e-12);
  EXPECT_NEAR(result[0].cruise_v_mm_s, 40.0, 1e-9);
}

TEST(BoundedPlan, KeepsAllBoundsAndCoversThePath) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  for (int trial = 0; trial < 100; ++trial) {
    const auto path = straight(20, 0.1 + 3.0 * uniform(random));
    std::vector<MoveBounds> bounds(path.size());
    std::vector<double> vertices(path.size() + 1, 0.0);
    for (MoveBounds& own : bounds) {
      own.speed_mm_s = 5.0 + 200.0 * uniform(random);
      own.accel_mm_s2 = 100.0 + 20000.0 * uniform(random);
    }
    for (std::size_t i = 1; i < path.size(); ++i) {
      vertices[i] = 1.0 + 100.0 * uniform(random);
    }
    const auto result = bounded_plan(path, bounds, vertices);
    for (std::size_t i = 0; i < result.size(); ++i) {
      const planner::PlannedMove& move = result[i];
      const double rounding = 1.0 + 1e-9;
      EXPECT_LE(move.cruise_v_mm_s, bounds[i].speed_mm_s * rounding);
      EXPECT_LE(move.accel_mm_s2, bounds[i].accel_mm_s2 * rounding);
      EXPECT_LE(move.start_v_mm_s, vertices[i] * rounding);
      EXPECT_LE(move.end_v_mm_s, vertices[i + 1] * rounding);
      EXPECT_GE(move.accel_s, 0.0);
      EXPECT_GE(move.decel_s, 0.0);
      const double covered = 0.5 * move.accel_s * (move.start_v_mm_s + move.cruise_v_mm_s) +
                             move.cruise_s * move.cruise_v_mm_s +
                             0.5 * move.decel_s * (move.end_v_mm_s + move.cruise_v_mm_s);
      EXPECT_NEAR(covered, move.length_mm, 1e-9);
      if (i > 0) {
        EXPECT_NEAR(move.start_v_mm_s, result[i - 1].end_v_mm_s, 1e-9);
      }
    }
  }
}

// Under the same limits everywhere it is the plan of a firmware without a corner limit.
TEST(BoundedPlan, IsKlippersPlanUnderKlippersLimits) {
  const auto path =
      plan({{0.0, 0.0}, {10.0, 0.0}, {10.0, 5.0}, {2.0, 5.0}}, planner_limits(80.0, 3000.0, 5.0));
  std::vector<MoveBounds> bounds(path.size());
  std::vector<double> vertices(path.size() + 1, 0.0);
  for (std::size_t i = 0; i < path.size(); ++i) {
    bounds[i] = {.speed_mm_s = 80.0, .accel_mm_s2 = 3000.0};
    vertices[i + 1] = path[i].end_v_mm_s;
  }
  EXPECT_NEAR(planner::duration_s(bounded_plan(path, bounds, vertices)), planner::duration_s(path),
              1e-9);
}

}  // namespace
}  // namespace unflex::timing
