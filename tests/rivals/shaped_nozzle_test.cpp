#include "unflex/rivals/shaped_nozzle.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "corner_plan.hpp"
#include "unflex/rivals/axis_path.hpp"

namespace unflex::rivals {
namespace {

using dynamics::NozzleMotion;

TEST(AxisPath, OfAPlanIsThePlan) {
  const auto moves = testing::corner_plan(100.0, 5000.0, 5.0);
  const AxisPath x = reference_path(moves, gcode::X);
  PathCursor cursor(x);
  EXPECT_DOUBLE_EQ(end_s(x), planner::duration_s(moves));
  EXPECT_EQ(cursor.at(-1.0).position, 0.0);
  for (double t = 0.0; t < planner::duration_s(moves); t += 1.7e-3) {
    const bool first = t < moves[0].duration_s();
    const double local = first ? t : t - moves[0].duration_s();
    EXPECT_NEAR(cursor.at(t).position, moves[first ? 0 : 1].position_mm(local)[gcode::X], 1e-12);
  }
  EXPECT_EQ(cursor.at(9.0).position, 10.0);
  EXPECT_EQ(cursor.at(9.0).velocity, 0.0);
  EXPECT_DOUBLE_EQ(peak(x).velocity_mm_s, 100.0);
  EXPECT_DOUBLE_EQ(peak(x).accel_mm_s2, 5000.0);
}

TEST(AxisPath, OfAShapedPlanMovesInWeightedSteps) {
  const AxisPath plan = reference_path(testing::corner_plan(100.0, 5000.0), gcode::X);
  const dynamics::ShaperPulses pulses =
      *dynamics::shaper_pulses(dynamics::ShaperKind::mzv, 45.0, 0.06);
  const AxisPath path = shaped(plan, pulses);
  PathCursor cursor(path);
  for (double t = -0.02; t < 0.3; t += 1.3e-3) {
    double expected = 0.0;
    for (const dynamics::Pulse& pulse : pulses) {
      PathCursor delayed(plan);
      expected += pulse.weight * delayed.at(t - pulse.time_s).position;
    }
    EXPECT_NEAR(cursor.at(t).position, expected, 1e-12);
  }
  EXPECT_NEAR(path.back().motion.position, 10.0, 1e-12);
  EXPECT_NEAR(path.back().motion.velocity, 0.0, 1e-10);
}

TEST(AxisPath, CarriesTheNozzleAsFineStepsDo) {
  const dynamics::FlexibleAxis axis{100.0, 0.5};
  const AxisPath path = reference_path(testing::corner_plan(100.0, 5000.0), gcode::X);
  const TimeGrid grid{-0.01, 3.7e-3, 80};
  const auto coarse = nozzle_on(axis, path, grid);
  ASSERT_EQ(coarse.size(), 80U);
  dynamics::NozzleState nozzle;
  PathCursor cursor(path);
  std::size_t k = 0;
  const double h = 1e-5;
  for (long i = 0; k < grid.count; ++i) {
    const double t = -0.01 + static_cast<double>(i) * h;
    while (k < grid.count && grid.at(k) <= t + 1e-9) {
      EXPECT_NEAR(nozzle.position(), coarse[k].position(), 1e-6) << k;
      ++k;
    }
    const NozzleMotion base = cursor.at(t);
    const NozzleMotion next = PathCursor(path).at(t + h);
    nozzle = dynamics::rk4_step(
        axis, nozzle, {base.position, base.velocity, (next.velocity - base.velocity) / h}, h);
  }
}

// The sum of delayed responses against the response to the sum of delayed references, with the true
// axis off by 10 % from the one that the shaper is built for.
TEST(ShapedNozzle, IsTheNozzleOnTheShapedBase) {
  const auto moves = testing::corner_plan(100.0, 5000.0, 5.0);
  const dynamics::FlexibleAxis axis = dynamics::from_frequency(45.0 * 1.1, 0.06);
  for (const dynamics::ShaperKind kind : dynamics::kShaperKinds) {
    const dynamics::ShaperPulses x = *dynamics::shaper_pulses(kind, 45.0, 0.06);
    const dynamics::ShaperPulses y = *dynamics::shaper_pulses(kind, 38.0, 0.06);
    const TimeGrid grid{-0.1, 5e-4, 1000};
    const AxisPath path_x = reference_path(moves, gcode::X);
    const AxisPath path_y = reference_path(moves, gcode::Y);
    const auto plain_x = nozzle_on(axis, path_x, grid);
    const auto plain_y = nozzle_on(axis, path_y, grid);
    const auto shaped_x = nozzle_on(axis, shaped(path_x, x), grid);
    const auto shaped_y = nozzle_on(axis, shaped(path_y, y), grid);
    ShapedNozzle nozzle({x, y});
    std::size_t next = 0;
    for (std::size_t k = 0; k < grid.count; ++k) {
      nozzle.add(grid.at(k), {plain_x[k].motion(), plain_y[k].motion()});
      for (; next < grid.count && grid.at(next) <= grid.at(k) - nozzle.lookahead_s(); ++next) {
        const dynamics::NozzleMotionXY at = nozzle.at(grid.at(next));
        EXPECT_NEAR(at.x.position, shaped_x[next].position(), 1e-6) << dynamics::name(kind);
        EXPECT_NEAR(at.y.position, shaped_y[next].position(), 1e-6) << dynamics::name(kind);
        EXPECT_NEAR(at.x.velocity, shaped_x[next].velocity(), 5e-3) << dynamics::name(kind);
      }
    }
    EXPECT_GT(next, 900U);
  }
}

TEST(ShapedNozzle, WithoutPulsesIsTheNozzleItself) {
  ShapedNozzle nozzle({});
  nozzle.add(0.0, {{1.0, 0.0}, {2.0, 5.0}});
  nozzle.add(0.1, {{1.0, 0.0}, {2.5, 5.0}});
  EXPECT_EQ(nozzle.lookahead_s(), 0.0);
  EXPECT_NEAR(nozzle.at(0.04).y.position, 2.2, 1e-15);
  EXPECT_NEAR(nozzle.at(0.04).x.position, 1.0, 1e-15);
}

}  // namespace
}  // namespace unflex::rivals
