#include "sections.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <vector>

#include "tours.hpp"

namespace unflex::timing {
namespace {

using compensate::testing::plan;
using compensate::testing::planner_limits;
using testing::bounds_of;
using testing::kLiftBounds;
using testing::kTolerance_mm;
using testing::lift;
using testing::Moves;
using testing::setup;
using testing::tour;

constexpr double kSettling_s = 0.03;

Moves straight(double length_mm) {
  return plan({{0.0, 0.0}, {0.6 * length_mm, 0.8 * length_mm}}, planner_limits(100.0, 2000.0, 5.0));
}

double duration_s(const Section& section) {
  double sum = 0.0;
  for (const Leg& leg : section.legs) {
    sum += leg.move.duration_s();
  }
  return sum;
}

TEST(Sections, CutALongLineWhereItIsEven) {
  const Moves moves = straight(100.0);
  const auto parts = sections(moves, bounds_of(moves), setup(), kSettling_s);
  ASSERT_TRUE(parts.has_value());
  ASSERT_EQ(parts->size(), 2U);
  const SectionedPart& first = parts->front();
  const SectionedPart& second = parts->back();
  ASSERT_EQ(first.section.legs.size(), 1U);
  ASSERT_EQ(second.section.legs.size(), 1U);
  EXPECT_FALSE(first.section.starts_even);
  EXPECT_TRUE(first.section.ends_even);
  EXPECT_TRUE(second.section.starts_even);
  EXPECT_FALSE(second.section.ends_even);
  EXPECT_NEAR(first.pause.velocity_mm_s.x, 60.0, 1e-9);
  EXPECT_NEAR(first.pause.velocity_mm_s.y, 80.0, 1e-9);
  EXPECT_EQ(second.pause.duration_s, 0.0);
  const planner::PlannedMove& before = first.section.legs[0].move;
  const planner::PlannedMove& after = second.section.legs[0].move;
  EXPECT_NEAR(before.length_mm + 100.0 * first.pause.duration_s + after.length_mm, 100.0, 1e-9);
  // Even motion is settled at the cut.
  EXPECT_NEAR(before.cruise_s, kSettling_s, 1e-12);
  EXPECT_NEAR(after.cruise_s, kSettling_s, 1e-12);
  EXPECT_GT(before.accel_s, 0.0);
  EXPECT_EQ(before.decel_s, 0.0);
  EXPECT_EQ(after.accel_s, 0.0);
  EXPECT_GT(after.decel_s, 0.0);
  EXPECT_NEAR(before.start_v_mm_s, 0.0, 1e-9);
  EXPECT_NEAR(before.end_v_mm_s, 100.0, 1e-9);
  EXPECT_NEAR(after.start_v_mm_s, 100.0, 1e-9);
  EXPECT_NEAR(after.end_v_mm_s, 0.0, 1e-9);
  for (const gcode::Axis axis : {gcode::X, gcode::Y}) {
    const double pause_mm_s = first.pause.velocity_mm_s[axis];
    EXPECT_NEAR(before.segment.end_mm[axis] + pause_mm_s * first.pause.duration_s,
                after.segment.start_mm[axis], 1e-9);
  }
}

TEST(Sections, LeaveALineWholeThatIsNotEvenForLong) {
  const Moves moves = straight(5.0);
  const auto parts = sections(moves, bounds_of(moves), setup(), kSettling_s);
  ASSERT_TRUE(parts.has_value());
  ASSERT_EQ(parts->size(), 1U);
  EXPECT_FALSE(parts->front().section.ends_even);
  EXPECT_EQ(parts->front().pause.duration_s, 0.0);
}

TEST(Sections, HaveAPauseWhereAMoveIsUpright) {
  Moves moves = plan({{0.0, 0.0}, {3.0, 0.0}, {3.0, 4.0}}, planner_limits(100.0, 2000.0, 5.0));
  const planner::PlannedMove up = lift(moves[0].segment.end_mm, 0.4);
  moves.insert(moves.begin() + 1, {up, up});
  std::vector<MoveBounds> bounds = bounds_of(moves);
  bounds[1] = bounds[2] = kLiftBounds;
  EXPECT_TRUE(is_upright(up));
  EXPECT_FALSE(is_upright(moves[0]));
  // 2 √(L/a)
  const double lift_s = from_rest_to_rest(up, kLiftBounds).duration_s();
  EXPECT_NEAR(lift_s, 2.0 * std::sqrt(0.4 / 100.0), 1e-12);
  const auto parts = sections(moves, bounds, setup(), kSettling_s);
  ASSERT_TRUE(parts.has_value());
  ASSERT_EQ(parts->size(), 2U);
  EXPECT_NEAR(parts->front().pause.duration_s, 2.0 * lift_s, 1e-12);
  EXPECT_EQ(parts->front().pause.velocity_mm_s.x, 0.0);
  EXPECT_EQ(parts->front().pause.velocity_mm_s.y, 0.0);
  for (const SectionedPart& part : *parts) {
    ASSERT_EQ(part.section.legs.size(), 1U);
    EXPECT_FALSE(part.section.starts_even);
    EXPECT_FALSE(part.section.ends_even);
    EXPECT_EQ(part.section.legs[0].move.start_v_mm_s, 0.0);
    EXPECT_EQ(part.section.legs[0].move.end_v_mm_s, 0.0);
  }
  EXPECT_NEAR(parts->back().section.legs[0].to_mm, 7.0, 1e-12);
}

TEST(Sections, BeginWithAPauseWhereTheFirstMoveIsUpright) {
  Moves moves = straight(5.0);
  moves.insert(moves.begin(), lift(moves[0].segment.start_mm, 0.4));
  std::vector<MoveBounds> bounds = bounds_of(moves);
  bounds[0] = kLiftBounds;
  const auto parts = sections(moves, bounds, setup(), kSettling_s);
  ASSERT_TRUE(parts.has_value());
  ASSERT_EQ(parts->size(), 2U);
  EXPECT_TRUE(parts->front().section.legs.empty());
  EXPECT_NEAR(parts->front().pause.duration_s, 0.126491, 1e-6);
  EXPECT_EQ(parts->back().section.legs.size(), 1U);
}

TEST(Sections, KnowNoLimitsOfAccelerationAlongThePath) {
  const Moves moves = straight(20.0);
  std::vector<MoveBounds> bounds = bounds_of(moves);
  bounds[0].accel_mm_s2 = 2000.0;
  EXPECT_FALSE(sections(moves, bounds, setup(), kSettling_s).has_value());
  // The base by itself does not reach this one.
  bounds[0].accel_mm_s2 = 1e6;
  EXPECT_TRUE(sections(moves, bounds, setup(), kSettling_s).has_value());
}

TEST(Sections, JoinMovesOnOneLine) {
  const Moves moves = plan({{0.0, 0.0}, {1.0, 0.0}, {2.0, 1e-3}, {4.0, 0.0}, {4.0, 3.0}},
                           planner_limits(100.0, 2000.0, 5.0));
  std::vector<MoveBounds> bounds = bounds_of(moves);
  const auto joined = sections(moves, bounds, setup(), 100.0);
  ASSERT_TRUE(joined.has_value());
  const std::vector<Leg>& legs = joined->front().section.legs;
  ASSERT_EQ(legs.size(), 2U);
  EXPECT_EQ(legs[0].move.segment.end_mm[gcode::X], 4.0);
  EXPECT_NEAR(legs[0].move.length_mm, 4.0, 1e-12);
  EXPECT_EQ(legs[0].from_mm, 0.0);
  EXPECT_NEAR(legs[0].to_mm, moves[0].length_mm + moves[1].length_mm + moves[2].length_mm, 1e-12);
  // What they may do tells them apart.
  bounds[1].speed_mm_s = 99.0;
  EXPECT_EQ(sections(moves, bounds, setup(), 100.0)->front().section.legs.size(), 4U);
  bounds[1].speed_mm_s = 100.0;
  bounds[1].tolerance_mm = 0.5 * kTolerance_mm;
  EXPECT_EQ(sections(moves, bounds, setup(), 100.0)->front().section.legs.size(), 4U);
}

TEST(Sections, KnowHowFarMovesAreFromALegThatStandsForThem) {
  const Moves moves =
      plan({{0.0, 0.0}, {1.0, 0.0}, {2.0, 1.5e-3}, {4.0, 0.0}}, planner_limits(100.0, 2000.0, 5.0));
  std::vector<MoveBounds> bounds = bounds_of(moves);
  const Section section = sections(moves, bounds, setup(), 100.0)->front().section;
  ASSERT_EQ(section.legs.size(), 1U);
  EXPECT_NEAR(section.legs[0].bulge_mm, 1.5e-3, 1e-9);
  // Where the tolerance is small, that is too far.
  for (MoveBounds& own : bounds) {
    own.tolerance_mm = 0.5 * kTolerance_mm;
  }
  EXPECT_GT(sections(moves, bounds, setup(), 100.0)->front().section.legs.size(), 1U);
}

TEST(Sections, TellTheLastOneHowFarNozzlesMaySwing) {
  Moves moves = plan({{0.0, 0.0}, {3.0, 0.0}, {3.0, 4.0}}, planner_limits(100.0, 2000.0, 5.0));
  moves.insert(moves.begin() + 1, lift(moves[0].segment.end_mm, 0.4));
  std::vector<MoveBounds> bounds = bounds_of(moves);
  bounds[1] = kLiftBounds;
  const auto parts = sections(moves, bounds, setup(), kSettling_s);
  ASSERT_EQ(parts->size(), 2U);
  EXPECT_FALSE(parts->front().section.swing_tolerance_mm);
  EXPECT_EQ(parts->back().section.swing_tolerance_mm, kTolerance_mm);
}

// A direction's length is 1 only nearly, and moves of a spiral have a slope.
TEST(Sections, JoinMovesOnOneLineInAnyDirection) {
  for (int i = 1; i < 20; ++i) {
    const double angle = 0.31 * i;
    std::vector<compensate::testing::Point> points;
    for (const double at_mm : {0.0, 1.1, 1.7, 4.2, 5.0}) {
      points.push_back({at_mm * std::cos(angle), at_mm * std::sin(angle)});
    }
    const Moves moves = plan(points, planner_limits(100.0, 2000.0, 5.0));
    EXPECT_EQ(sections(moves, bounds_of(moves), setup(), 100.0)->front().section.legs.size(), 1U)
        << angle;
  }
}

TEST(Sections, TellFeedsApart) {
  const auto with = [](double feed_mm_s) {
    Leg leg;
    leg.feed_mm_s = feed_mm_s;
    return leg;
  };
  EXPECT_TRUE(have_same_feed(with(100.0), with(100.0 + 1e-9)));
  EXPECT_TRUE(have_same_feed(with(planner::kNoLimit), with(planner::kNoLimit)));
  EXPECT_FALSE(have_same_feed(with(100.0), with(100.1)));
  EXPECT_FALSE(have_same_feed(with(planner::kNoLimit), with(100.0)));
  EXPECT_FALSE(have_same_feed(with(100.0), with(planner::kNoLimit)));
}

TEST(Sections, DoNotJoinMovesThatTurn) {
  const Moves bent =
      plan({{0.0, 0.0}, {2.0, 0.02}, {4.0, 0.0}}, planner_limits(100.0, 2000.0, 5.0));
  EXPECT_EQ(sections(bent, bounds_of(bent), setup(), 100.0)->front().section.legs.size(), 2U);
  // Nor such that come back on the same line.
  const Moves back = plan({{0.0, 0.0}, {2.0, 0.0}, {0.0, 0.0}}, planner_limits(100.0, 2000.0, 5.0));
  EXPECT_EQ(sections(back, bounds_of(back), setup(), 100.0)->front().section.legs.size(), 2U);
}

TEST(Sections, CoverThePathWithoutGaps) {
  bool has_even_pause = false;
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const Moves moves = tour(seed, 50.0, true);
    const auto parts = sections(moves, bounds_of(moves), setup(), kSettling_s);
    ASSERT_TRUE(parts.has_value());
    double at_mm = 0.0;
    double even_mm_s = 0.0;
    for (const SectionedPart& part : *parts) {
      EXPECT_EQ(part.section.starts_even, even_mm_s > 0.0);
      for (const Leg& leg : part.section.legs) {
        EXPECT_NEAR(leg.from_mm, at_mm, 1e-9) << seed;
        EXPECT_GT(leg.to_mm, leg.from_mm);
        at_mm = leg.to_mm;
      }
      even_mm_s = length(part.pause.velocity_mm_s);
      EXPECT_EQ(part.section.ends_even, even_mm_s > 0.0);
      has_even_pause = has_even_pause || even_mm_s > 0.0;
      at_mm += even_mm_s * part.pause.duration_s;
      EXPECT_GT(duration_s(part.section), 0.0);
    }
    double length_mm = 0.0;
    for (const planner::PlannedMove& move : moves) {
      length_mm += move.length_mm;
    }
    EXPECT_NEAR(at_mm, length_mm, 1e-9) << seed;
  }
  EXPECT_TRUE(has_even_pause);
}

}  // namespace
}  // namespace unflex::timing
