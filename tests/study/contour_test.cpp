#include "contour.hpp"

#include <gtest/gtest.h>

#include "unflex/study/case.hpp"

namespace unflex::study {
namespace {

std::vector<planner::PlannedMove> reference_corner() {
  return corner(thesis_cases().front(), thesis_cases().front().accel_mm_s2);
}

TEST(ContourGauge, MeasuresToTheNearestPointOfTheEdges) {
  ContourGauge gauge(reference_corner(), 1.0);
  EXPECT_NEAR(gauge.measure(0.0, {-0.3, 0.4}).distance_mm, 0.5, 1e-15);
  EXPECT_NEAR(gauge.measure(0.05, {4.0, -0.2}).distance_mm, 0.2, 1e-15);
  EXPECT_NEAR(gauge.measure(0.12, {10.3, -0.4}).distance_mm, 0.5, 1e-15);
  EXPECT_NEAR(gauge.measure(0.2, {9.9, 5.0}).distance_mm, 0.1, 1e-14);
  EXPECT_NEAR(gauge.measure(0.3, {10.0, 10.7}).distance_mm, 0.7, 1e-14);
}

// At the end of the path its beginning is close in place, but not in time.
TEST(ContourGauge, SeesOnlyWhatThePlanPassesAroundThatTime) {
  ContourGauge gauge(reference_corner(), 0.03);
  EXPECT_NEAR(gauge.measure(0.01, {9.9, 5.0}).distance_mm, 5.0, 1e-14);
  EXPECT_NEAR(gauge.measure(0.2, {5.0, 0.0}).distance_mm, 5.0, 1e-14);
}

TEST(ContourGauge, TellsWhereFilamentIsLaid) {
  auto moves = reference_corner();
  moves[1].segment.end_mm[gcode::E] = moves[1].segment.start_mm[gcode::E];
  ContourGauge gauge(moves, 0.03);
  EXPECT_TRUE(gauge.measure(0.05, {0.0, 0.0}).extruding);
  EXPECT_FALSE(gauge.measure(0.15, {0.0, 0.0}).extruding);
}

}  // namespace
}  // namespace unflex::study
