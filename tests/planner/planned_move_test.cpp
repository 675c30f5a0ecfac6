#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "planner/plan_helpers.hpp"
#include "unflex/planner/planner.hpp"

namespace unflex::planner {
namespace {

using testing::plan;
using testing::segment;

// 0.5 s from 10 to 60 mm/s, 1 s at 60 mm/s, 0.4 s down to 20 mm/s; 17.5 + 60 + 16 mm along X.
PlannedMove hand_made() {
  PlannedMove move;
  move.segment = segment({5.0, 7.0, 0.3, 2.0}, {98.5, 7.0, 0.3, 2.0 + 93.5 * 0.04}, 60.0);
  move.direction = {1.0, 0.0, 0.0, 0.04};
  move.length_mm = 93.5;
  move.start_v_mm_s = 10.0;
  move.cruise_v_mm_s = 60.0;
  move.end_v_mm_s = 20.0;
  move.accel_mm_s2 = 100.0;
  move.accel_s = 0.5;
  move.cruise_s = 1.0;
  move.decel_s = 0.4;
  return move;
}

TEST(PlannedMove, CoversTheDistanceOfATrapezoid) {
  const PlannedMove move = hand_made();
  EXPECT_DOUBLE_EQ(move.duration_s(), 1.9);
  EXPECT_DOUBLE_EQ(move.distance_mm(0.2), 4.0);
  EXPECT_DOUBLE_EQ(move.distance_mm(0.5), 17.5);
  EXPECT_DOUBLE_EQ(move.distance_mm(1.0), 47.5);
  EXPECT_DOUBLE_EQ(move.distance_mm(1.5), 77.5);
  EXPECT_NEAR(move.distance_mm(1.7), 77.5 + 10.0, 1e-12);
}

TEST(PlannedMove, LeadsAtTheSpeedOfItsStart) {
  PlannedMove move = hand_made();
  move.lead_s = 0.25;
  move.accel_s = 0.0;
  move.cruise_s = 1.25;
  EXPECT_DOUBLE_EQ(move.duration_s(), 1.9);
  EXPECT_DOUBLE_EQ(move.distance_mm(0.2), 2.0);
  EXPECT_DOUBLE_EQ(move.distance_mm(0.25), 2.5);
  EXPECT_DOUBLE_EQ(move.distance_mm(0.75), 32.5);
  EXPECT_DOUBLE_EQ(move.velocity_mm_s(0.2), 10.0);
  EXPECT_DOUBLE_EQ(move.velocity_mm_s(0.3), 60.0);
  EXPECT_DOUBLE_EQ(move.time_s(2.0), 0.2);
  EXPECT_DOUBLE_EQ(move.time_s(32.5), 0.75);
  EXPECT_DOUBLE_EQ(move.phases()[0].duration_s, 0.25);
  EXPECT_DOUBLE_EQ(move.phases()[2].speed_mm_s, 60.0);
}

TEST(PlannedMove, HasTheVelocityOfATrapezoid) {
  const PlannedMove move = hand_made();
  EXPECT_DOUBLE_EQ(move.velocity_mm_s(-1.0), 10.0);
  EXPECT_DOUBLE_EQ(move.velocity_mm_s(0.2), 30.0);
  EXPECT_DOUBLE_EQ(move.velocity_mm_s(1.0), 60.0);
  EXPECT_NEAR(move.velocity_mm_s(1.7), 40.0, 1e-12);
  EXPECT_DOUBLE_EQ(move.velocity_mm_s(2.0), 20.0);
}

TEST(PlannedMove, IsAtItsEndsExactlyAndStaysThere) {
  const PlannedMove move = hand_made();
  EXPECT_EQ(move.position_mm(-0.1), move.segment.start_mm);
  EXPECT_EQ(move.position_mm(0.0), move.segment.start_mm);
  EXPECT_EQ(move.position_mm(1.9), move.segment.end_mm);
  EXPECT_EQ(move.position_mm(5.0), move.segment.end_mm);
  EXPECT_DOUBLE_EQ(move.distance_mm(-0.1), 0.0);
  EXPECT_DOUBLE_EQ(move.distance_mm(5.0), 93.5);
  EXPECT_DOUBLE_EQ(move.time_s(-1.0), 0.0);
  EXPECT_DOUBLE_EQ(move.time_s(94.0), 1.9);
}

TEST(PlannedMove, MovesAllAxesTogether) {
  const gcode::Position middle = hand_made().position_mm(1.0);
  EXPECT_DOUBLE_EQ(middle[gcode::X], 52.5);
  EXPECT_DOUBLE_EQ(middle[gcode::Y], 7.0);
  EXPECT_DOUBLE_EQ(middle[gcode::Z], 0.3);
  EXPECT_DOUBLE_EQ(middle[gcode::E], 2.0 + 47.5 * 0.04);
}

TEST(PlannedMove, HoldsXyzWhileOnlyTheExtruderMoves) {
  const auto moves = plan({segment({1.0, 2.0, 3.0, 10.0}, {1.0, 2.0, 3.0, 9.2}, 30.0)}, Limits{});
  ASSERT_EQ(moves.size(), 1U);
  const gcode::Position middle = moves[0].position_mm(0.5 * moves[0].duration_s());
  EXPECT_EQ(middle[gcode::X], 1.0);
  EXPECT_EQ(middle[gcode::Z], 3.0);
  EXPECT_NEAR(middle[gcode::E], 9.6, 1e-12);
}

TEST(PlannedMove, TellsTheTimeOfADistanceInEachPhase) {
  const PlannedMove move = hand_made();
  EXPECT_NEAR(move.time_s(4.0), 0.2, 1e-15);
  EXPECT_NEAR(move.time_s(47.5), 1.0, 1e-15);
  EXPECT_NEAR(move.time_s(87.5), 1.7, 1e-14);
}

TEST(PlannedMove, TellsTimeWithoutCancellationNextToAStandstillAndAtHighSpeed) {
  // From rest d = a t²/2; a naive root −v + √(v² + 2ad) loses all digits in the second case.
  PlannedMove move = hand_made();
  move.start_v_mm_s = 0.0;
  move.accel_s = 0.6;
  EXPECT_NEAR(move.time_s(1e-14), std::sqrt(2e-16), 1e-20);
  move.start_v_mm_s = 59.999;
  move.accel_s = 1e-5;
  EXPECT_NEAR(move.time_s(1e-12) * 59.999, 1e-12, 1e-24);
}

TEST(PlannedMove, TurnsTimeToDistanceAndBack) {
  std::mt19937_64 random(99);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (int trial = 0; trial < 3000; ++trial) {
    PlannedMove move = hand_made();
    move.accel_mm_s2 = std::exp(4.0 + 6.0 * unit(random));
    move.cruise_v_mm_s = 1.0 + 300.0 * unit(random);
    move.start_v_mm_s = trial % 7 == 0 ? 0.0 : move.cruise_v_mm_s * unit(random);
    move.end_v_mm_s = trial % 5 == 0 ? 0.0 : move.cruise_v_mm_s * unit(random);
    move.accel_s = (move.cruise_v_mm_s - move.start_v_mm_s) / move.accel_mm_s2;
    move.decel_s = (move.cruise_v_mm_s - move.end_v_mm_s) / move.accel_mm_s2;
    move.cruise_s = trial % 3 == 0 ? 0.0 : 0.1 * unit(random);
    move.length_mm = 0.5 * (move.start_v_mm_s + move.cruise_v_mm_s) * move.accel_s +
                     move.cruise_v_mm_s * move.cruise_s +
                     0.5 * (move.end_v_mm_s + move.cruise_v_mm_s) * move.decel_s;
    double before = 0.0;
    for (int i = 1; i <= 50; ++i) {
      const double t = move.duration_s() * i / 50.0;
      const double d = move.distance_mm(t);
      ASSERT_GE(d, before);
      ASSERT_NEAR(move.distance_mm(move.time_s(d)), d, 1e-13 * move.length_mm);
      const double v = std::max(move.velocity_mm_s(t), 1e-3);
      ASSERT_NEAR(move.time_s(d), t, 1e-12 * move.length_mm / v + 1e-15);
      before = d;
    }
  }
}

TEST(PlannedMove, HasItsVelocityAsTheSlopeOfItsDistance) {
  const PlannedMove move = hand_made();
  const double dt = 1e-6;
  for (const double t : {0.1, 0.3, 0.7, 1.2, 1.6, 1.85}) {
    const double slope = (move.distance_mm(t + dt) - move.distance_mm(t - dt)) / (2.0 * dt);
    EXPECT_NEAR(slope, move.velocity_mm_s(t), 1e-6);
  }
}

TEST(Corners, AreSharpFromTwentyDegreesOn) {
  const auto direction = [](double degrees) {
    const double angle = degrees * std::numbers::pi / 180.0;
    return gcode::Position{std::cos(angle), std::sin(angle), 0.0, 0.0};
  };
  for (const double from : {0.0, 77.0, 200.0}) {
    EXPECT_FALSE(turns_sharply(direction(from), direction(from + 19.9)));
    EXPECT_TRUE(turns_sharply(direction(from), direction(from + 20.1)));
    EXPECT_TRUE(turns_sharply(direction(from), direction(from - 179.0)));
  }
  // The share of X and Y in the direction does not count.
  EXPECT_TRUE(turns_sharply({0.1, 0.0, 0.99, 0.0}, {0.0, 0.1, 0.99, 0.0}));
}

}  // namespace
}  // namespace unflex::planner
