#include "unflex/planner/plan_times.hpp"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "planner/plan_helpers.hpp"

namespace unflex::planner {
namespace {

using testing::plan;
using testing::polyline;

std::vector<PlannedMove> zigzag() {
  return plan(
      polyline({{0, 0, 0, 0}, {20, 0, 0, 1}, {20, 5, 0, 2}, {3, 5, 0, 3}, {3, 5, 2, 3}}, 100.0),
      Limits{});
}

TEST(PlanTimes, BeginWhereThePlanDoesAndEndWithItsLastMove) {
  const std::vector<PlannedMove> moves = zigzag();
  const std::vector<double> starts = starts_s(moves, 0.25);
  ASSERT_EQ(starts.size(), moves.size() + 1);
  EXPECT_EQ(starts.front(), 0.25);
  EXPECT_DOUBLE_EQ(starts.back(), 0.25 + duration_s(moves));
  for (std::size_t i = 0; i < moves.size(); ++i) {
    EXPECT_DOUBLE_EQ(starts[i + 1] - starts[i], moves[i].duration_s());
  }
}

TEST(PlanTimes, FindTheMoveThatHasStartedLast) {
  const std::vector<double> starts = {1.0, 2.0, 2.0, 5.0};
  EXPECT_EQ(move_at(starts, 0.0), 0U);
  EXPECT_EQ(move_at(starts, 1.0), 0U);
  EXPECT_EQ(move_at(starts, 1.9), 0U);
  EXPECT_EQ(move_at(starts, 2.0), 2U);  // the one between takes no time
  EXPECT_EQ(move_at(starts, 5.0), 2U);
  EXPECT_EQ(move_at(starts, 9.0), 2U);
}

TEST(PlanTimes, AreFoundTheSameFromAnEarlierMoveOn) {
  const std::vector<double> starts = starts_s(zigzag());
  std::mt19937 random(7);
  std::uniform_real_distribution<double> more(0.0, 0.1);
  std::size_t now = 0;
  for (double t = -0.2; t < starts.back() + 0.3; t += more(random)) {
    now = move_at(starts, t, now);
    EXPECT_EQ(now, move_at(starts, t)) << t;
  }
}

TEST(PlanCursor, VisitsEachStretchOnceAndInOrder) {
  const std::vector<PlannedMove> moves = zigzag();
  PlanCursor cursor(moves);
  std::vector<double> visited_s(moves.size(), 0.0);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> more(0.0, 0.07);
  double t = 0.0;
  while (!cursor.at_end()) {
    t += more(random);
    cursor.to(t, [&](const PlannedMove& move, double from_s, double to_s) {
      double& end_s = visited_s[static_cast<std::size_t>(&move - moves.data())];
      EXPECT_DOUBLE_EQ(from_s, end_s);
      end_s = to_s;
    });
    if (!cursor.at_end()) {
      const std::vector<double> starts = starts_s(moves);
      const std::size_t now = move_at(starts, t);
      EXPECT_EQ(cursor.position_mm(), moves[now].position_mm(t - starts[now]));
    }
  }
  for (std::size_t i = 0; i < moves.size(); ++i) {
    EXPECT_DOUBLE_EQ(visited_s[i], moves[i].duration_s());
  }
}

}  // namespace
}  // namespace unflex::planner
