// RepRapFirmware's rules against closed forms.
#include "unflex/planner/rrf_planner.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "planner/plan_helpers.hpp"
#include "planner/rrf_limits.hpp"

namespace unflex::planner {
namespace {

using enum gcode::Axis;
using testing::polyline;
using testing::segment;

constexpr double kClock_s = 1.0 / 750000.0;
// Relative accuracy of speeds, given the firmware's floats.
constexpr double kFloat = 1e-6;

FirmwareConfig rrf_config() {
  FirmwareConfig config;
  config.firmware = Firmware::rrf;
  return config;
}

Limits fast_limits(int jerk_policy) {
  Limits limits = testing::rrf_default_limits();
  limits.axis_max_velocity_mm_s = {300.0, 300.0, 20.0, 100.0};
  limits.axis_max_accel_mm_s2 = {3000.0, 3000.0, 200.0, 5000.0};
  limits.axis_jerk_mm_s = {8.0, 8.0, 2.0, 5.0};
  limits.jerk_policy = jerk_policy;
  return limits;
}

std::vector<PlannedMove> rrf_plan(const std::vector<gcode::Segment>& segments, const Limits& limits,
                                  const FirmwareConfig& config = rrf_config()) {
  RrfPlanner planner(limits, config);
  for (const gcode::Segment& each : segments) planner.add(each);
  planner.stop();
  std::vector<PlannedMove> moves;
  planner.take(moves);
  return moves;
}

// Speed between two moves of 50 mm that turn by the angle.
double corner_speed(double degrees, int jerk_policy) {
  const double angle = degrees * std::numbers::pi / 180.0;
  const auto moves = rrf_plan(
      polyline({{50, 0, 0, 0}, {50 + 50 * std::cos(angle), 50 * std::sin(angle), 0, 0}}, 100.0),
      fast_limits(jerk_policy));
  return moves.at(0).end_v_mm_s;
}

TEST(RrfPlanner, FirmwareDefaultsAreThoseOfItsConfiguration) {
  const Limits limits = testing::rrf_default_limits();
  EXPECT_EQ(limits.axis_max_velocity_mm_s, (std::array<double, 4>{100, 100, 20, 100}));
  EXPECT_EQ(limits.axis_max_accel_mm_s2, (std::array<double, 4>{1000, 1000, 200, 500}));
  EXPECT_EQ(limits.axis_jerk_mm_s, (std::array<double, 4>{15, 15, 10, 5}));
  EXPECT_EQ(limits.print_accel_mm_s2, 50000.0);
  EXPECT_EQ(limits.travel_accel_mm_s2, 50000.0);
  EXPECT_EQ(limits.min_movement_velocity_mm_s, 0.5);
  EXPECT_EQ(limits.jerk_policy, 0);
  EXPECT_EQ(FirmwareConfig{}.ring_length, 60);
  EXPECT_EQ(FirmwareConfig{}.step_clock_hz, 750000.0);
}

TEST(RrfPlanner, LoneMoveIsATrapezoidFromStandstillToStandstill) {
  const auto moves = rrf_plan(polyline({{50, 0, 0, 0}}, 80.0), testing::rrf_default_limits());
  ASSERT_EQ(moves.size(), 1U);
  EXPECT_EQ(moves[0].start_v_mm_s, 0.0);
  EXPECT_EQ(moves[0].end_v_mm_s, 0.0);
  EXPECT_NEAR(moves[0].cruise_v_mm_s, 80.0, 80.0 * kFloat);
  EXPECT_NEAR(moves[0].accel_mm_s2, 1000.0, 1000.0 * kFloat);
  EXPECT_NEAR(moves[0].duration_s(), 50.0 / 80.0 + 80.0 / 1000.0, 2 * kClock_s);
}

TEST(RrfPlanner, ShortMoveIsATriangle) {
  const auto moves = rrf_plan(polyline({{1, 0, 0, 0}}, 80.0), testing::rrf_default_limits());
  EXPECT_NEAR(moves.at(0).cruise_v_mm_s, std::sqrt(1000.0), 1e-4);
  EXPECT_NEAR(moves.at(0).duration_s(), 2.0 * std::sqrt(1.0 / 1000.0), 2 * kClock_s);
}

TEST(RrfPlanner, MovesLastWholeStepClocksRoundedDown) {
  for (const double clock_hz : {750000.0, 937500.0}) {
    FirmwareConfig config = rrf_config();
    config.step_clock_hz = clock_hz;
    const auto moves =
        rrf_plan(polyline({{7, 0, 0, 0}}, 30.0), testing::rrf_default_limits(), config);
    const double exact = clock_hz * (7.0 / 30.0 + 30.0 / 1000.0);
    const double clocks = clock_hz * moves.at(0).duration_s();
    EXPECT_NEAR(clocks, std::round(clocks), 1e-6);
    EXPECT_LE(clocks, exact + 0.05);
    EXPECT_GE(clocks, exact - 1.05);
  }
}

// Ramps of 22 500 clocks each, and 25 000 clocks per mm of steady motion between them.
TEST(RrfPlanner, From36EachPhaseIsRoundedToWholeStepClocks) {
  FirmwareConfig config = rrf_config();
  config.steps_per_mm = {};
  config.rounds_phases = true;
  for (const double part : {0.3, 0.7}) {
    const auto moves = rrf_plan(polyline({{7.0 + part / 25000.0, 0, 0, 0}}, 30.0),
                                testing::rrf_default_limits(), config);
    EXPECT_NEAR(config.step_clock_hz * moves.at(0).duration_s(), 197500.0 + std::round(part), 1e-6);
  }
}

// A tenth of a micrometre in the middle of a fast straight line, whether steady or on a ramp.
TEST(RrfPlanner, MovesOfLessThanAStepClockLastOne) {
  for (const double end_mm : {15.0, 60.0}) {
    const auto moves = rrf_plan(
        polyline({{10, 0, 0, 0}, {10.0001, 0, 0, 0}, {end_mm, 0, 0, 0}}, 200.0), fast_limits(1));
    ASSERT_EQ(moves.size(), 3U);
    EXPECT_LT(moves[1].length_mm, moves[1].start_v_mm_s * kClock_s);
    EXPECT_NEAR(moves[1].duration_s(), kClock_s, 1e-12);
    for (const double phase_s : {moves[1].accel_s, moves[1].cruise_s, moves[1].decel_s}) {
      EXPECT_GE(phase_s, 0.0);
    }
  }
}

TEST(RrfPlanner, CornerSpeedIsTheJerkOverTheChangeOfDirection) {
  for (const int policy : {0, 1}) {
    EXPECT_NEAR(corner_speed(0.0, policy), 100.0, 1e-4);
    EXPECT_NEAR(corner_speed(45.0, policy), 8.0 / std::sqrt(0.5), 1e-4);  // Y changes most
    EXPECT_NEAR(corner_speed(90.0, policy), 8.0, 1e-4);
    EXPECT_NEAR(corner_speed(135.0, policy), 8.0 / (1.0 + std::sqrt(0.5)), 1e-4);
    EXPECT_NEAR(corner_speed(180.0, policy), 4.0, 1e-4);
  }
}

TEST(RrfPlanner, ExtruderLimitsTheJointByItsOwnJerk) {
  Limits limits = fast_limits(1);
  limits.axis_jerk_mm_s[E] = 0.5;
  const auto moves = rrf_plan(polyline({{50, 0, 0, 2.0}, {100, 0, 0, 5.0}}, 100.0), limits);
  EXPECT_NEAR(moves.at(0).end_v_mm_s, 0.5 / (0.06 - 0.04), 1e-3);
}

TEST(RrfPlanner, PolicyZeroStopsBetweenTravelAndPrintAndPolicyOneDoesNot) {
  const auto path = polyline({{50, 0, 0, 0}, {100, 0, 0, 2.0}, {150, 0, 0, 2.0}}, 100.0);
  const auto stops = rrf_plan(path, fast_limits(0));
  const auto runs = rrf_plan(path, fast_limits(1));
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(stops.at(i).end_v_mm_s, 0.0);
    EXPECT_NEAR(runs.at(i).end_v_mm_s, 100.0, 1e-4);
  }
}

TEST(RrfPlanner, PolicyZeroTakesAWipeForAnotherKindThanATravel) {
  const auto path = polyline({{50, 0, 0, 0}, {100, 0, 0, -1.0}}, 100.0);
  EXPECT_EQ(rrf_plan(path, fast_limits(0)).at(0).end_v_mm_s, 0.0);
  EXPECT_GT(rrf_plan(path, fast_limits(1)).at(0).end_v_mm_s, 99.0);
}

TEST(RrfPlanner, ZAndExtruderMovesAreNotJoinedInPolicyZero) {
  const auto path = polyline({{0, 0, 1, 0}, {0, 0, 1, 1}}, 10.0);
  EXPECT_EQ(rrf_plan(path, fast_limits(0)).at(0).end_v_mm_s, 0.0);
  EXPECT_NEAR(rrf_plan(path, fast_limits(1)).at(0).end_v_mm_s, 2.0, 1e-4);
}

TEST(RrfPlanner, FeedCountsInXYZAndForTheFilamentWhereItMovesAlone) {
  Limits limits = fast_limits(1);
  limits.axis_max_velocity_mm_s[Z] = 300.0;
  const auto moves = rrf_plan(
      {segment({}, {30, 0, 40, 1}, 20.0), segment({30, 0, 40, 1}, {30, 0, 40, 8}, 20.0)}, limits);
  EXPECT_NEAR(moves.at(0).length_mm, 50.0, 1e-5);
  EXPECT_TRUE(moves[0].kinematic);
  EXPECT_NEAR(moves[0].cruise_v_mm_s, 20.0, 1e-5);
  EXPECT_NEAR(moves.at(1).length_mm, 7.0, 1e-6);
  EXPECT_FALSE(moves[1].kinematic);
  EXPECT_NEAR(moves[1].cruise_v_mm_s, 20.0, 1e-5);
  EXPECT_NEAR(moves[1].direction[E], 1.0, kFloat);
}

TEST(RrfPlanner, EachAxisLimitsByItsShareOfTheDirection) {
  Limits limits = fast_limits(0);
  limits.axis_max_velocity_mm_s = {60.0, 300.0, 20.0, 2.0};
  limits.axis_max_accel_mm_s2 = {900.0, 3000.0, 200.0, 50.0};
  const auto moves = rrf_plan(
      {segment({}, {60, 80, 0, 0}, 500.0), segment({60, 80, 0, 0}, {60, 180, 0, 5}, 500.0)},
      limits);
  EXPECT_NEAR(moves.at(0).cruise_v_mm_s, 60.0 / 0.6, 1e-4);
  EXPECT_NEAR(moves[0].accel_mm_s2, 900.0 / 0.6, 1e-2);
  EXPECT_NEAR(moves.at(1).cruise_v_mm_s, 2.0 / 0.05, 1e-4);
  EXPECT_NEAR(moves[1].accel_mm_s2, 50.0 / 0.05, 1e-2);
}

TEST(RrfPlanner, M204LimitsMovesInXYOnlyByWhetherTheyPrint) {
  Limits limits = fast_limits(1);
  limits.print_accel_mm_s2 = 700.0;
  limits.travel_accel_mm_s2 = 90.0;
  const auto moves = rrf_plan(
      {segment({}, {50, 0, 0, 1}, 50.0), segment({50, 0, 0, 1}, {60, 0, 0, 1}, 50.0),
       segment({60, 0, 0, 1}, {60, 0, 5, 1}, 10.0), segment({60, 0, 5, 1}, {60, 0, 5, 6}, 10.0),
       segment({60, 0, 5, 6}, {70, 0, 5, 5}, 10.0)},
      limits);
  const std::vector<double> expected = {700.0, 90.0, 200.0, 5000.0, 90.0};
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_NEAR(moves.at(i).accel_mm_s2, expected[i], 1e-5 * expected[i]) << i;
  }
}

TEST(RrfPlanner, SlowFeedsAreRaisedToTheMinimumUnlessAnAxisCannotFollow) {
  Limits limits = fast_limits(1);
  limits.axis_max_velocity_mm_s[E] = 1.0;
  EXPECT_NEAR(rrf_plan(polyline({{5, 0, 0, 0}}, 0.1), limits).at(0).cruise_v_mm_s, 0.5, 1e-6);
  EXPECT_NEAR(rrf_plan(polyline({{5, 0, 0, 25}}, 0.1), limits).at(0).cruise_v_mm_s, 0.2, 1e-6);
}

TEST(RrfPlanner, AMoveWithoutLengthIsNotQueued) {
  RrfPlanner planner(fast_limits(0), rrf_config());
  EXPECT_FALSE(planner.add(segment({1, 2, 3, 4}, {1, 2, 3, 4}, 10.0)));
  EXPECT_EQ(planner.pending(), 0U);
}

TEST(RrfPlanner, MotorsEndOnWholeStepsAndFilamentIsNotRounded) {
  const auto moves = rrf_plan(polyline({{1.004, 2.009, 0.3011, 0.123456}}, 10.0), fast_limits(0));
  const gcode::Position& end = moves.at(0).segment.end_mm;
  EXPECT_NEAR(end[X], 80.0 / 80.0, 1e-12);
  EXPECT_NEAR(end[Y], 161.0 / 80.0, 1e-12);
  EXPECT_NEAR(end[Z], 120.0 / 400.0, 1e-12);
  EXPECT_EQ(end[E], 0.123456);
  EXPECT_NEAR(moves[0].length_mm, std::hypot(1.004, 2.009, 0.3011), 1e-6);
  const gcode::Position near_end = moves[0].position_mm(moves[0].duration_s() * (1.0 - 1e-9));
  for (const auto axis : {X, Y, Z, E}) EXPECT_NEAR(near_end[axis], end[axis], 1e-6);
}

TEST(RrfPlanner, AnAxisWithoutStepsPerMmIsNotRounded) {
  FirmwareConfig config = rrf_config();
  config.steps_per_mm = {0.0, 0.0, 0.0, 0.0};
  const gcode::Position to{1.004, 2.009, 0.3011, 0.123456};
  EXPECT_EQ(rrf_plan(polyline({to}, 10.0), fast_limits(0), config).at(0).segment.end_mm, to);
}

TEST(RrfPlanner, NothingIsFinalBeforeTheRingIsFull) {
  RrfPlanner planner(fast_limits(1), rrf_config());
  std::vector<PlannedMove> moves;
  gcode::Position at{};
  const auto add = [&] {
    gcode::Position to = at;
    to[X] += 0.5;
    planner.add(segment(at, to, 50.0));
    at = to;
  };
  // The ring holds 59.
  for (int i = 0; i < 58; ++i) add();
  EXPECT_EQ(planner.take(moves), 0U);
  EXPECT_EQ(planner.pending(), 58U);
  add();
  EXPECT_GT(planner.take(moves), 0U);
  planner.stop();
  planner.take(moves);
  EXPECT_EQ(moves.size(), 59U);
  EXPECT_EQ(planner.pending(), 0U);
  EXPECT_EQ(moves.back().end_v_mm_s, 0.0);
}

// Only as many moves as last two seconds are provisional, so slow moves are frozen early.
TEST(RrfPlanner, AboutTwoSecondsOfMotionAreProvisional) {
  RrfPlanner planner(fast_limits(1), rrf_config());
  std::vector<PlannedMove> moves;
  gcode::Position at{};
  std::size_t queued = 0;
  while (planner.take(moves) == 0) {
    gcode::Position to = at;
    to[X] += 2.0;  // 0.2 s each
    planner.add(segment(at, to, 10.0));
    at = to;
    ++queued;
  }
  EXPECT_GE(queued, 10U);
  EXPECT_LE(queued, 12U);
}

// In a dense line half the ring is frozen; the provisional half must be able to stop the machine.
TEST(RrfPlanner, HalfTheRingBoundsTheSpeedOfADenseLine) {
  Limits limits = fast_limits(1);
  const double length = 0.02;
  std::vector<gcode::Position> points;
  for (int i = 1; i <= 600; ++i) points.push_back({i * length, 0, 0, 0});
  for (const int ring : {20, 40, 60}) {
    FirmwareConfig config = rrf_config();
    config.ring_length = ring;
    const auto moves = rrf_plan(polyline(points, 200.0), limits, config);
    double fastest = 0.0;
    for (std::size_t i = 200; i < 400; ++i) fastest = std::max(fastest, moves[i].end_v_mm_s);
    const double stoppable = std::sqrt(2.0 * 3000.0 * length * ring / 2);
    EXPECT_NEAR(fastest, stoppable, 0.05 * stoppable) << ring;
  }
}

// The second move is so short that its end, not the jerk, limits the first joint. The third move
// lifts this limit. Then the jerk in force at that moment decides.
TEST(RrfPlanner, NewJerkCountsForJointsThatAreStillProvisional) {
  const auto path = polyline({{50, 0, 0, 0}, {50, 0.005, 0, 0}, {50, 50, 0, 0}}, 100.0);
  for (const double jerk : {8.0, 20.0}) {
    RrfPlanner planner(fast_limits(1), rrf_config());
    planner.add(path[0]);
    planner.add(path[1]);
    gcode::LimitChange change;
    change.axis_jerk_mm_s[X] = jerk;
    change.axis_jerk_mm_s[Y] = jerk;
    planner.apply(change);
    planner.add(path[2]);
    planner.stop();
    std::vector<PlannedMove> moves;
    planner.take(moves);
    EXPECT_NEAR(moves.at(0).end_v_mm_s, jerk, 1e-4);
  }
}

gcode::LimitChange print_accel(double mm_s2) {
  gcode::LimitChange change;
  change.print_accel_mm_s2 = mm_s2;
  return change;
}

// A dense line of 200 moves. Its limits are low from behind the hundredth move on; `between` is
// called just before that. The number of the first move that they hold for.
template <class Between>
std::size_t first_with_new_limits(std::size_t per_line, const Between& between) {
  RrfPlanner planner(fast_limits(1), rrf_config());
  for (std::size_t i = 0; i < 200; ++i) {
    if (i == 100) {
      between(planner);
      planner.apply(print_accel(500.0));
    }
    const auto at = static_cast<double>(i);
    gcode::Segment each = segment({at, 0, 0, at}, {at + 1, 0, 0, at + 1}, 50.0);
    each.line = 1 + i / per_line;
    planner.add(each);
  }
  planner.stop();
  std::vector<PlannedMove> moves;
  planner.take(moves);
  const auto slow = std::ranges::find_if(
      moves, [](const PlannedMove& move) { return move.accel_mm_s2 < 1000.0; });
  return static_cast<std::size_t>(slow - moves.begin());
}

TEST(RrfPlanner, LimitsHoldForTheMoveThatWaitsInFrontOfAFullRing) {
  EXPECT_EQ(first_with_new_limits(1, [](RrfPlanner&) {}), 99U);
}

// As a line without motion or a fan's command does.
TEST(RrfPlanner, LimitsHoldForNoMoveBeforeALineThatNeedsTheBuffer) {
  gcode::Event line;
  line.waits_for_buffer = true;
  EXPECT_EQ(first_with_new_limits(1, [&](RrfPlanner& planner) { planner.apply(line); }), 100U);
}

TEST(RrfPlanner, LimitsHoldForTheRestOfAnArcThatWaits) {
  EXPECT_LT(first_with_new_limits(50, [](RrfPlanner&) {}), 99U);
}

TEST(RrfPlanner, LimitsLeaveAMoveAloneThatFoundRoomInTheRing) {
  RrfPlanner planner(fast_limits(1), rrf_config());
  planner.add(segment({0, 0, 0, 0}, {10, 0, 0, 1}, 50.0));
  planner.apply(print_accel(500.0));
  planner.add(segment({10, 0, 0, 1}, {20, 0, 0, 2}, 50.0));
  planner.stop();
  std::vector<PlannedMove> moves;
  planner.take(moves);
  EXPECT_NEAR(moves.at(0).accel_mm_s2, 3000.0, 1.0);
  EXPECT_NEAR(moves.at(1).accel_mm_s2, 500.0, 1.0);
}

TEST(RrfPlanner, AMoveAfterAStopBeginsAtAStandstill) {
  RrfPlanner planner(fast_limits(1), rrf_config());
  const auto path = polyline({{50, 0, 0, 0}, {100, 0, 0, 0}}, 100.0);
  planner.add(path[0]);
  planner.stop();
  planner.add(path[1]);
  planner.stop();
  std::vector<PlannedMove> moves;
  planner.take(moves);
  EXPECT_EQ(moves.at(0).end_v_mm_s, 0.0);
  EXPECT_EQ(moves.at(1).start_v_mm_s, 0.0);
}

// 32 bits of step clocks overflow after 95 minutes.
TEST(RrfPlanner, MovesOfHoursTakeAsLongAsTheirSpeedSays) {
  const auto moves = rrf_plan(polyline({{5000, 0, 0, 0}, {5001, 0, 0, 0}}, 0.5), fast_limits(0));
  ASSERT_EQ(moves.size(), 2U);
  EXPECT_NEAR(moves[0].duration_s(), 10000.0, 0.1);
  EXPECT_NEAR(moves[0].distance_mm(moves[0].duration_s()), 5000.0, 1e-2);
}

}  // namespace
}  // namespace unflex::planner
