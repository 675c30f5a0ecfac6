#include <gtest/gtest.h>

#include "unflex/timing/timing.hpp"

namespace unflex::timing {
namespace {

planner::PlannedMove move_along(double x, double y, double z, double e) {
  planner::PlannedMove move;
  move.direction = {x, y, z, e};
  return move;
}

TEST(BoundsByAxes, OfKlipperAreThoseOfZAndOfFilamentDrawnBack) {
  planner::Limits limits;
  limits.max_velocity_mm_s = 300.0;
  planner::FirmwareConfig config;
  config.max_z_velocity_mm_s = 10.0;
  config.max_z_accel_mm_s2 = 100.0;
  config.max_extrude_only_velocity_mm_s = 40.0;
  config.max_extrude_only_accel_mm_s2 = 1000.0;
  EXPECT_EQ(bounds_by_axes(move_along(1.0, 0.0, 0.0, 0.05), limits, config).speed_mm_s, 300.0);
  EXPECT_EQ(bounds_by_axes(move_along(1.0, 0.0, 0.0, 0.05), limits, config).accel_mm_s2,
            planner::kNoLimit);
  const MoveBounds rises = bounds_by_axes(move_along(0.995, 0.0, 0.1, 0.05), limits, config);
  EXPECT_NEAR(rises.speed_mm_s, 100.0, 1e-9);
  EXPECT_NEAR(rises.accel_mm_s2, 1000.0, 1e-9);
  const MoveBounds wipes = bounds_by_axes(move_along(1.0, 0.0, 0.0, -0.5), limits, config);
  EXPECT_NEAR(wipes.speed_mm_s, 80.0, 1e-9);
  EXPECT_NEAR(wipes.accel_mm_s2, 2000.0, 1e-9);
}

TEST(BoundsByAxes, OfMarlinAreThoseOfEachAxis) {
  planner::Limits limits;
  limits.axis_max_velocity_mm_s = {200.0, 100.0, 5.0, 25.0};
  limits.axis_max_accel_mm_s2 = {3000.0, 3000.0, 100.0, 10000.0};
  planner::FirmwareConfig config;
  config.firmware = Firmware::marlin;
  // Acceleration of X and Y is what the tolerance is chosen for.
  const MoveBounds flat = bounds_by_axes(move_along(0.6, 0.8, 0.0, 0.05), limits, config);
  EXPECT_NEAR(flat.speed_mm_s, 125.0, 1e-9);
  EXPECT_NEAR(flat.accel_mm_s2, 200000.0, 1e-6);
  const MoveBounds rises = bounds_by_axes(move_along(0.0, 0.995, 0.1, 0.0), limits, config);
  EXPECT_NEAR(rises.speed_mm_s, 50.0, 1e-9);
  EXPECT_NEAR(rises.accel_mm_s2, 1000.0, 1e-9);
}

}  // namespace
}  // namespace unflex::timing
