#include "unflex/timing/stretched.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "../compensate/playback.hpp"

namespace unflex::timing {
namespace {

using compensate::testing::plan;
using compensate::testing::planner_limits;

TEST(Stretched, IsAtEveryPlaceLaterByTheFactor) {
  auto moves =
      plan({{0.0, 0.0}, {10.0, 0.0}, {10.0, 5.0}, {2.0, 5.0}}, planner_limits(80.0, 3000.0, 5.0));
  moves[1].lead_s = 0.01;
  constexpr double kFactor = 1.7;
  const auto slower = stretched(moves, kFactor);
  ASSERT_EQ(slower.size(), moves.size());
  EXPECT_NEAR(planner::duration_s(slower), kFactor * planner::duration_s(moves), 1e-12);
  for (std::size_t i = 0; i < moves.size(); ++i) {
    EXPECT_EQ(slower[i].segment.end_mm, moves[i].segment.end_mm);
    for (int k = 0; k <= 20; ++k) {
      const double t = k / 20.0 * moves[i].duration_s();
      EXPECT_NEAR(slower[i].distance_mm(kFactor * t), moves[i].distance_mm(t), 1e-9);
      EXPECT_NEAR(slower[i].velocity_mm_s(kFactor * t), moves[i].velocity_mm_s(t) / kFactor, 1e-9);
    }
    EXPECT_NEAR(slower[i].accel_mm_s2, moves[i].accel_mm_s2 / (kFactor * kFactor), 1e-9);
  }
}

TEST(Stretched, ByOneIsThePlanItself) {
  const auto moves = plan({{0.0, 0.0}, {10.0, 0.0}}, planner_limits(80.0, 3000.0, 5.0));
  const auto same = stretched(moves, 1.0);
  EXPECT_EQ(same[0].duration_s(), moves[0].duration_s());
  EXPECT_EQ(same[0].cruise_v_mm_s, moves[0].cruise_v_mm_s);
}

}  // namespace
}  // namespace unflex::timing
