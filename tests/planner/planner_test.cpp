#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "planner/plan_helpers.hpp"
#include "unflex/planner/klipper_planner.hpp"

namespace unflex::planner {
namespace {

using testing::plan;
using testing::polyline;
using testing::segment;

constexpr double kSqrt2Minus1 = std::numbers::sqrt2 - 1.0;

Limits limits_with(double max_accel_mm_s2, double minimum_cruise_ratio = 0.0) {
  Limits limits;
  limits.max_accel_mm_s2 = max_accel_mm_s2;
  limits.minimum_cruise_ratio = minimum_cruise_ratio;
  return limits;
}

// Speed at the junction of two 100 mm moves at 200 mm/s that turn by the given angle, a = 1000.
double corner_speed(double turn_deg, double square_corner_velocity_mm_s) {
  Limits limits = limits_with(1000.0);
  limits.square_corner_velocity_mm_s = square_corner_velocity_mm_s;
  const double turn = turn_deg * std::numbers::pi / 180.0;
  const auto moves = plan(
      polyline({{100.0, 0.0, 0.0, 0.0}, {100.0 + 100.0 * std::cos(turn), 100.0 * std::sin(turn)}},
               200.0),
      limits);
  EXPECT_EQ(moves[0].end_v_mm_s, moves[1].start_v_mm_s);
  return moves[1].start_v_mm_s;
}

TEST(Planner, MakesALongMoveATrapezoid) {
  const auto moves = plan(polyline({{100.0, 0.0, 0.0, 0.0}}, 100.0), limits_with(1000.0, 0.5));
  ASSERT_EQ(moves.size(), 1U);
  EXPECT_DOUBLE_EQ(moves[0].accel_s, 0.1);
  EXPECT_DOUBLE_EQ(moves[0].cruise_s, 0.9);
  EXPECT_DOUBLE_EQ(moves[0].decel_s, 0.1);
  EXPECT_DOUBLE_EQ(moves[0].cruise_v_mm_s, 100.0);
  EXPECT_EQ(moves[0].start_v_mm_s, 0.0);
  EXPECT_EQ(moves[0].end_v_mm_s, 0.0);
  EXPECT_EQ(moves[0].accel_mm_s2, 1000.0);
  EXPECT_EQ(moves[0].length_mm, 100.0);
  EXPECT_EQ(moves[0].direction, (std::array<double, 4>{1.0, 0.0, 0.0, 0.0}));
}

TEST(Planner, MakesAShortMoveATriangleWithoutMinimumCruiseRatio) {
  const auto moves = plan(polyline({{1.0, 0.0, 0.0, 0.0}}, 300.0), limits_with(1000.0));
  EXPECT_DOUBLE_EQ(moves[0].cruise_v_mm_s, std::sqrt(1000.0));
  EXPECT_NEAR(moves[0].cruise_s, 0.0, 1e-15);
  EXPECT_NEAR(moves[0].accel_s, std::sqrt(1e-3), 1e-15);
}

TEST(Planner, CruisesForTheMinimumCruiseRatioOfAShortMove) {
  for (const double ratio : {0.25, 0.5, 0.8}) {
    const auto moves = plan(polyline({{1.0, 0.0, 0.0, 0.0}}, 300.0), limits_with(1000.0, ratio));
    EXPECT_NEAR(moves[0].cruise_s * moves[0].cruise_v_mm_s, ratio, 1e-12);
    EXPECT_NEAR(moves[0].cruise_v_mm_s, std::sqrt(1000.0 * (1.0 - ratio)), 1e-12);
  }
}

TEST(Planner, PlansAChainOfCollinearPiecesAsOneMove) {
  for (const double ratio : {0.0, 0.5}) {
    for (const double feed : {300.0, 40.0}) {
      std::vector<gcode::Position> points;
      for (int i = 1; i <= 64; ++i) points.push_back({i * 0.125, 0.0, 0.0, 0.0});
      const auto chain = plan(polyline(points, feed), limits_with(1000.0, ratio));
      const auto whole = plan(polyline({{8.0, 0.0, 0.0, 0.0}}, feed), limits_with(1000.0, ratio));
      EXPECT_NEAR(duration_s(chain), whole[0].duration_s(), 1e-12);
    }
  }
}

TEST(Planner, PassesARightAngleAtTheSquareCornerVelocity) {
  EXPECT_NEAR(corner_speed(90.0, 5.0), 5.0, 1e-12);
  EXPECT_NEAR(corner_speed(-90.0, 8.0), 8.0, 1e-12);
}

TEST(Planner, PassesOtherAnglesByJunctionDeviation) {
  for (const double turn_deg : {10.0, 30.0, 60.0, 120.0, 170.0}) {
    const double s = std::cos(0.5 * turn_deg * std::numbers::pi / 180.0);
    EXPECT_NEAR(corner_speed(turn_deg, 5.0), 5.0 * std::sqrt(kSqrt2Minus1 * s / (1.0 - s)), 1e-9)
        << turn_deg;
  }
}

TEST(Planner, DoesNotSlowDownBetweenCollinearMoves) {
  EXPECT_DOUBLE_EQ(corner_speed(0.0, 5.0), 200.0);
}

TEST(Planner, StopsWhereTheMotionReverses) { EXPECT_NEAR(corner_speed(180.0, 5.0), 0.0, 1e-6); }

TEST(Planner, StopsExactlyWhereTheMotionReversesAlongAnAxis) {
  const auto moves =
      plan(polyline({{10.0, 0.0, 0.0, 0.0}, {0.0, 0.0, 0.0, 0.0}}, 100.0), limits_with(1000.0));
  EXPECT_EQ(moves[0].end_v_mm_s, 0.0);
  EXPECT_EQ(moves[1].start_v_mm_s, 0.0);
}

TEST(Planner, FollowsAPolygonAtTheCentripetalAccelerationOfItsCircle) {
  // Radius ρ, turning by φ at each vertex: v² = aρ cos(φ/2).
  const double radius = 1.0;
  const double phi = 2.0 * std::numbers::pi / 120.0;
  std::vector<gcode::Position> points;
  for (int i = 1; i <= 360; ++i) {
    points.push_back({radius * std::sin(i * phi), radius * (1.0 - std::cos(i * phi)), 0.0, 0.0});
  }
  const auto moves = plan(polyline(points, 200.0), limits_with(1000.0));
  const double expected = std::sqrt(1000.0 * radius * std::cos(0.5 * phi));
  for (std::size_t i = 100; i < 260; ++i) EXPECT_NEAR(moves[i].start_v_mm_s, expected, 1e-9);
}

TEST(Planner, KeepsAJunctionBelowBothFeeds) {
  const gcode::Position a{50.0, 0.0, 0.0, 0.0};
  const gcode::Position b{100.0, 0.0, 0.0, 0.0};
  const Limits limits = limits_with(1000.0);
  const auto faster = plan({segment({}, a, 30.0), segment(a, b, 90.0)}, limits);
  EXPECT_DOUBLE_EQ(faster[1].start_v_mm_s, 30.0);
  EXPECT_DOUBLE_EQ(faster[1].cruise_v_mm_s, 90.0);
  const auto slower = plan({segment({}, a, 90.0), segment(a, b, 30.0)}, limits);
  EXPECT_DOUBLE_EQ(slower[0].end_v_mm_s, 30.0);
  EXPECT_DOUBLE_EQ(slower[0].cruise_v_mm_s, 90.0);
}

TEST(Planner, BrakesOverSeveralShortMovesBeforeAStop) {
  // 1 mm pieces: v² = 2a·(distance to the end) near the end.
  std::vector<gcode::Position> points;
  for (int i = 1; i <= 40; ++i) points.push_back({static_cast<double>(i), 0.0, 0.0, 0.0});
  const auto moves = plan(polyline(points, 100.0), limits_with(1000.0));
  for (int left = 1; left <= 4; ++left) {
    EXPECT_NEAR(moves[static_cast<std::size_t>(40 - left)].start_v_mm_s, std::sqrt(2000.0 * left),
                1e-10);
    EXPECT_NEAR(moves[static_cast<std::size_t>(left)].start_v_mm_s, std::sqrt(2000.0 * left),
                1e-10);
  }
  EXPECT_DOUBLE_EQ(moves[20].cruise_v_mm_s, 100.0);
}

TEST(Planner, LimitsAJunctionByTheChangeOfExtrusionPerMillimetre) {
  const gcode::Position a{100.0, 0.0, 0.0, 5.0};
  const gcode::Position b{200.0, 0.0, 0.0, 8.0};  // 0.05, then 0.03 mm/mm
  FirmwareConfig fixed;
  const auto moves =
      plan({segment({}, a, 200.0), segment(a, b, 200.0)}, limits_with(1000.0), fixed);
  EXPECT_NEAR(moves[1].start_v_mm_s, 1.0 / 0.02, 1e-9);
  fixed.instantaneous_corner_velocity_mm_s = 2.0;
  const auto looser =
      plan({segment({}, a, 200.0), segment(a, b, 200.0)}, limits_with(1000.0), fixed);
  EXPECT_NEAR(looser[1].start_v_mm_s, 2.0 / 0.02, 1e-9);
}

TEST(Planner, StopsForAMoveOfTheExtruderAlone) {
  const gcode::Position a{50.0, 0.0, 0.0, 0.0};
  const gcode::Position b{50.0, 0.0, 0.0, 10.0};
  const gcode::Position c{100.0, 0.0, 0.0, 10.0};
  const auto moves =
      plan({segment({}, a, 100.0), segment(a, b, 500.0), segment(b, c, 100.0)}, Limits{});
  EXPECT_EQ(moves[0].end_v_mm_s, 0.0);
  EXPECT_EQ(moves[1].start_v_mm_s, 0.0);
  EXPECT_EQ(moves[1].end_v_mm_s, 0.0);
  EXPECT_EQ(moves[2].start_v_mm_s, 0.0);
  EXPECT_FALSE(moves[1].kinematic);
  EXPECT_DOUBLE_EQ(moves[1].length_mm, 10.0);
  EXPECT_EQ(moves[1].direction, (std::array<double, 4>{0.0, 0.0, 0.0, 1.0}));
  EXPECT_DOUBLE_EQ(moves[1].accel_mm_s2, FirmwareConfig{}.max_extrude_only_accel_mm_s2);
  EXPECT_DOUBLE_EQ(moves[1].cruise_v_mm_s, FirmwareConfig{}.max_extrude_only_velocity_mm_s);
}

TEST(Planner, LimitsARetractionDuringAMoveByTheExtruder) {
  const FirmwareConfig fixed;
  const auto moves = plan({segment({}, {100.0, 0.0, 0.0, -50.0}, 300.0)}, Limits{}, fixed);
  EXPECT_DOUBLE_EQ(moves[0].accel_mm_s2, fixed.max_extrude_only_accel_mm_s2 / 0.5);
  EXPECT_DOUBLE_EQ(moves[0].cruise_v_mm_s, fixed.max_extrude_only_velocity_mm_s / 0.5);
}

TEST(Planner, LimitsExtrusionDuringAMoveOfZAloneButNotDuringOneInXy) {
  const FirmwareConfig fixed;
  const auto up = plan({segment({}, {0.0, 0.0, 100.0, 50.0}, 300.0)}, Limits{}, fixed);
  EXPECT_DOUBLE_EQ(up[0].accel_mm_s2, fixed.max_extrude_only_accel_mm_s2 / 0.5);
  const auto along = plan({segment({}, {100.0, 0.0, 0.0, 50.0}, 300.0)}, Limits{}, fixed);
  EXPECT_DOUBLE_EQ(along[0].accel_mm_s2, 5000.0);
  EXPECT_DOUBLE_EQ(along[0].cruise_v_mm_s, 300.0);
}

TEST(Planner, LimitsMovesWithZByTheSharesOfZ) {
  FirmwareConfig fixed;
  fixed.max_z_velocity_mm_s = 12.0;
  fixed.max_z_accel_mm_s2 = 120.0;
  const auto moves = plan({segment({}, {40.0, 0.0, 30.0, 0.0}, 300.0)}, Limits{}, fixed);
  EXPECT_NEAR(moves[0].cruise_v_mm_s, 20.0, 1e-12);
  EXPECT_NEAR(moves[0].accel_mm_s2, 200.0, 1e-12);
  EXPECT_DOUBLE_EQ(moves[0].length_mm, 50.0);
}

TEST(Planner, DoesNotLimitTheExtruderAloneByTheMachinesVelocity) {
  Limits limits;
  limits.max_velocity_mm_s = 20.0;
  const auto moves = plan({segment({}, {0.0, 0.0, 0.0, 30.0}, 40.0)}, limits);
  EXPECT_DOUBLE_EQ(moves[0].cruise_v_mm_s, 40.0);
}

TEST(Planner, AppliesNewLimitsToTheMovesThatFollow) {
  KlipperPlanner planner(limits_with(1000.0), {});
  planner.add(segment({}, {100.0, 0.0, 0.0, 0.0}, 100.0));
  gcode::LimitChange change;
  change.max_accel_mm_s2 = 500.0;
  change.max_velocity_mm_s = 60.0;
  planner.apply(change);
  planner.add(segment({100.0, 0.0, 0.0, 0.0}, {200.0, 0.0, 0.0, 0.0}, 100.0));
  planner.stop();
  std::vector<PlannedMove> moves;
  ASSERT_EQ(planner.take(moves), 2U);
  EXPECT_EQ(moves[0].accel_mm_s2, 1000.0);
  EXPECT_DOUBLE_EQ(moves[0].cruise_v_mm_s, 100.0);
  EXPECT_EQ(moves[1].accel_mm_s2, 500.0);
  EXPECT_DOUBLE_EQ(moves[1].start_v_mm_s, 60.0);
  EXPECT_DOUBLE_EQ(moves[1].decel_s, 0.12);
  EXPECT_EQ(planner.limits().max_accel_mm_s2, 500.0);
  EXPECT_EQ(planner.limits().minimum_cruise_ratio, 0.0);
}

TEST(Planner, PassesACornerBetweenTwoLimitsAtTheLowerOne) {
  for (const bool lower_first : {true, false}) {
    KlipperPlanner planner(limits_with(1000.0), {});
    gcode::LimitChange change;
    change.square_corner_velocity_mm_s = lower_first ? 3.0 : 7.0;
    planner.apply(change);
    planner.add(segment({}, {100.0, 0.0, 0.0, 0.0}, 100.0));
    change.square_corner_velocity_mm_s = lower_first ? 7.0 : 3.0;
    planner.apply(change);
    planner.add(segment({100.0, 0.0, 0.0, 0.0}, {100.0, 100.0, 0.0, 0.0}, 100.0));
    planner.stop();
    std::vector<PlannedMove> moves;
    planner.take(moves);
    EXPECT_NEAR(moves[1].start_v_mm_s, 3.0, 1e-12);
  }
}

TEST(Planner, AppliesAChangedMinimumCruiseRatio) {
  KlipperPlanner planner(limits_with(1000.0, 0.5), {});
  gcode::LimitChange change;
  change.minimum_cruise_ratio = 0.0;
  planner.apply(change);
  planner.add(segment({}, {1.0, 0.0, 0.0, 0.0}, 300.0));
  planner.stop();
  std::vector<PlannedMove> moves;
  planner.take(moves);
  EXPECT_NEAR(moves[0].cruise_s, 0.0, 1e-15);
}

TEST(Planner, QueuesNothingForASegmentWithoutLength) {
  KlipperPlanner planner({}, {});
  EXPECT_FALSE(planner.add(segment({1.0, 2.0, 3.0, 4.0}, {1.0, 2.0, 3.0, 4.0}, 10.0)));
  EXPECT_FALSE(planner.add(segment({1.0, 2.0, 3.0, 4.0}, {1.0 + 1e-12, 2.0, 3.0, 4.0}, 10.0)));
  EXPECT_EQ(planner.pending(), 0U);
  planner.stop();
  std::vector<PlannedMove> moves;
  EXPECT_EQ(planner.take(moves), 0U);
  EXPECT_TRUE(moves.empty());
}

TEST(Planner, TakesMotionBelowANanometreForExtrusionAlone) {
  const auto moves = plan({segment({1.0, 0.0, 0.0, 0.0}, {1.0 + 5e-10, 0.0, 0.0, 1.0}, 10.0)}, {});
  ASSERT_EQ(moves.size(), 1U);
  EXPECT_FALSE(moves[0].kinematic);
  EXPECT_DOUBLE_EQ(moves[0].length_mm, 1.0);
}

TEST(Planner, HandsOutEveryMoveOnceAndInOrder) {
  KlipperPlanner planner({}, {});
  std::vector<PlannedMove> moves;
  gcode::Position at{};
  for (std::size_t i = 1; i <= 1000; ++i) {
    gcode::Segment next = segment(at, {static_cast<double>(i), 0.0, 0.0, 0.0}, 100.0);
    next.line = i;
    at = next.end_mm;
    ASSERT_TRUE(planner.add(next));
    const std::size_t before = moves.size();
    const std::size_t taken = planner.take(moves);
    ASSERT_EQ(taken, moves.size() - before);
    ASSERT_EQ(planner.pending() + moves.size(), i);
    ASSERT_LT(planner.pending(), 150U) << "the lookahead grows without bound";
  }
  planner.stop();
  planner.take(moves);
  ASSERT_EQ(moves.size(), 1000U);
  EXPECT_EQ(planner.pending(), 0U);
  for (std::size_t i = 0; i < moves.size(); ++i) EXPECT_EQ(moves[i].segment.line, i + 1);
}

TEST(Planner, StandsStillAtAStop) {
  KlipperPlanner planner(limits_with(1000.0), {});
  planner.add(segment({}, {100.0, 0.0, 0.0, 0.0}, 100.0));
  planner.stop();
  planner.add(segment({100.0, 0.0, 0.0, 0.0}, {200.0, 0.0, 0.0, 0.0}, 100.0));
  planner.stop();
  std::vector<PlannedMove> moves;
  ASSERT_EQ(planner.take(moves), 2U);
  EXPECT_EQ(moves[0].end_v_mm_s, 0.0);
  EXPECT_EQ(moves[1].start_v_mm_s, 0.0);
}

}  // namespace
}  // namespace unflex::planner
