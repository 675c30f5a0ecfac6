#include "unflex/verify/near_path.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "replaying.hpp"

namespace unflex::verify {
namespace {

// A path that passes close to itself: it goes there, and back 1 mm beside.
std::vector<planner::PlannedMove> hairpin() {
  planner::Limits limits;
  limits.max_accel_mm_s2 = 1e6;
  return testing::plan_path(
      {{0.0, 0.0, 100.0}, {50.0, 0.0, 100.0, 1.0}, {50.0, 1.0, 100.0, 0.1}, {0.0, 1.0, 100.0, 1.0}},
      limits);
}

TEST(NearPath, MeasuresTheDistanceToThePathNearTheTime) {
  const std::vector<planner::PlannedMove> moves = hairpin();
  const ReferencePath path = testing::path_of(moves, 10.0);
  NearPath near(0.03);
  near.begin(path);
  std::size_t nearest = 99;
  // Half way along the first move. The way back would be nearer, but is out of reach in time.
  near.slide(path, 0.25);
  EXPECT_NEAR(std::sqrt(near.squared_contour_error(path, {25.0, 0.8}, nearest)), 0.8, 1e-9);
  EXPECT_EQ(nearest, 0U);
  // The path counts no further than its reach in time, 3 mm ahead.
  EXPECT_NEAR(std::sqrt(near.squared_contour_error(path, {35.0, 0.0}, nearest)), 7.0, 0.1);
  // At the turn all three pieces are near.
  near.slide(path, 0.505);
  EXPECT_NEAR(std::sqrt(near.squared_contour_error(path, {49.0, 0.9}, nearest)), 0.1, 1e-9);
  EXPECT_EQ(nearest, 2U);
  near.slide(path, 0.75);
  EXPECT_NEAR(std::sqrt(near.squared_contour_error(path, {26.0, 0.2}, nearest)), 0.8, 1e-9);
  EXPECT_EQ(nearest, 2U);
}

TEST(NearPath, ReachesHalfAPeriodOfTheSlowerAxis) {
  NozzleModel model;
  model.x = dynamics::from_frequency(50.0, 0.1);
  model.y = dynamics::from_frequency(25.0, 0.1);
  EXPECT_NEAR(reach_s(model), 0.02 + 0.02, 1e-12);
}

}  // namespace
}  // namespace unflex::verify
