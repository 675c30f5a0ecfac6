// S-curves and filtered B-splines.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "corner_plan.hpp"
#include "unflex/rivals/filtered_spline.hpp"
#include "unflex/rivals/s_curve.hpp"

namespace unflex::rivals {
namespace {

TEST(SCurve, TakesTheSameTimeForTheSameRampsAtTwiceTheAcceleration) {
  const auto moves = testing::corner_plan(100.0, 5000.0);
  const AxisPath plan = reference_path(moves, gcode::X);
  const AxisPath curve = s_curve(moves, gcode::X);
  EXPECT_DOUBLE_EQ(end_s(curve), end_s(plan));
  PathCursor on_plan(plan);
  PathCursor on_curve(curve);
  // At the ends of all ramps both have the same place and speed.
  for (const double t : {0.0, 0.02, 0.05, 0.1, 0.12, 0.2}) {
    const dynamics::NozzleMotion a = on_plan.at(t);
    const dynamics::NozzleMotion b = on_curve.at(t);
    EXPECT_NEAR(a.position, b.position, 1e-9) << t;
    EXPECT_NEAR(a.velocity, b.velocity, 1e-9) << t;
  }
  EXPECT_NEAR(peak(curve).accel_mm_s2, 10000.0, 0.02 * 10000.0);
  EXPECT_NEAR(peak(curve).velocity_mm_s, 100.0, 1e-9);
}

TEST(SCurve, HasNoJumpOfAccelerationAndTheLeastJerkForItsTime) {
  const auto moves = testing::corner_plan(100.0, 5000.0);
  const AxisPath curve = s_curve(moves, gcode::X);
  const double jerk = 4.0 * 5000.0 / 0.02;
  double before = 0.0;
  for (std::size_t i = 0; i + 1 < curve.size(); ++i) {
    const double step_s = std::min(curve[i + 1].start_s - curve[i].start_s, 0.02 / 64.0);
    EXPECT_LE(std::abs(curve[i].motion.acceleration - before), 1.001 * jerk * step_s) << i;
    before = curve[i].motion.acceleration;
  }
}

TEST(SCurve, GoesAlongTheMoveOnEveryAxis) {
  const auto moves = testing::corner_plan(100.0, 5000.0, 5.0);
  PathCursor x(s_curve(moves, gcode::X));
  const AxisPath path_y = s_curve(moves, gcode::Y);
  PathCursor y(path_y);
  EXPECT_EQ(y.at(0.5 * moves[0].duration_s()).position, 0.0);
  EXPECT_NEAR(path_y.back().motion.position, 10.0, 1e-12);
}

const dynamics::FlexibleAxis kAxis{282.7, 0.06};

SplineOptions options(double omega) {
  const double knot_s = 2.0 * std::numbers::pi / omega / 10.0;
  return {knot_s, 5.0 * knot_s, 5.0 * knot_s};
}

// Largest distance of the nozzle on the path from the reference.
double tracking_error(const AxisPath& path, const AxisPath& reference,
                      const dynamics::FlexibleAxis& axis) {
  const TimeGrid grid{-0.05, 1e-4, 12000};
  const auto nozzle = nozzle_on(axis, path, grid);
  PathCursor cursor(reference);
  double worst = 0.0;
  for (std::size_t k = 0; k < grid.count; ++k) {
    worst = std::max(worst, std::abs(nozzle[k].position() - cursor.at(grid.at(k)).position));
  }
  return worst;
}

TEST(FilteredSpline, BeginsAndEndsAtRestWithinItsLeadInAndTail) {
  const AxisPath reference = reference_path(testing::corner_plan(100.0, 5000.0), gcode::X);
  const SplineOptions given = options(kAxis.main().omega_rad_s);
  const AxisPath path = filtered_spline(reference, kAxis, given).path;
  EXPECT_NEAR(path.front().start_s, -given.lead_in_s, 1e-12);
  EXPECT_EQ(path.front().motion.position, 0.0);
  EXPECT_NEAR(path.front().motion.velocity, 0.0, 1e-9);
  EXPECT_NEAR(path.back().motion.position, 10.0, 1e-9);
  PathCursor cursor(path);
  const dynamics::NozzleMotion end = cursor.at(end_s(reference) + given.tail_s + given.knot_s);
  EXPECT_NEAR(end.position, 10.0, 1e-6);
  EXPECT_NEAR(end.velocity, 0.0, 1e-3);
}

TEST(FilteredSpline, BringsTheNozzleMuchCloserToTheReference) {
  const AxisPath reference = reference_path(testing::corner_plan(100.0, 5000.0), gcode::X);
  const AxisPath path = filtered_spline(reference, kAxis, options(kAxis.main().omega_rad_s)).path;
  EXPECT_GT(tracking_error(reference, reference, kAxis), 0.1);
  EXPECT_LT(tracking_error(path, reference, kAxis), 0.002);
}

// A plan gives the same motion alone, where it fits into one window, and amid a long rest of 200
// knots in windows of 60.
TEST(FilteredSpline, LosesNothingByItsLimitedPreview) {
  AxisPath reference = reference_path(testing::corner_plan(100.0, 5000.0), gcode::X);
  const AxisPath alone = filtered_spline(reference, kAxis, options(kAxis.main().omega_rad_s)).path;
  reference.push_back({1.0, {10.0, 0.0, 0.0}});
  const AxisPath amid = filtered_spline(reference, kAxis, options(kAxis.main().omega_rad_s)).path;
  EXPECT_GT(amid.size(), 2 * alone.size());
  PathCursor a(alone);
  PathCursor b(amid);
  for (double t = -0.01; t < 0.1; t += 1e-3) {
    EXPECT_NEAR(a.at(t).position, b.at(t).position, 1e-4) << t;
  }
}

}  // namespace
}  // namespace unflex::rivals
