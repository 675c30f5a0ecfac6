// Marlin's rules one by one, against closed forms.
#include "unflex/planner/marlin_planner.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "planner/marlin_helpers.hpp"

namespace unflex::planner {
namespace {

using enum gcode::Axis;
using testing::marlin_config;
using testing::marlin_limits;
using testing::marlin_plan;
using testing::polyline;
using testing::segment;

// One step of X or Y, and the largest error of a rate that is rounded up to whole steps per second.
constexpr double kStep_mm = 1.0 / 80.0;
constexpr double kRounding_mm_s = 2.0 * kStep_mm;
// MINIMAL_STEP_RATE along X or Y.
constexpr double kSlowest_mm_s = 120.0 * kStep_mm;

// Equal pieces of a straight line along X.
std::vector<gcode::Segment> dense_line(int count, double piece_mm, double feed_mm_s) {
  std::vector<gcode::Position> points;
  for (int i = 1; i <= count; ++i) points.push_back({i * piece_mm, 0.0, 0.0, 0.0});
  return polyline(points, feed_mm_s);
}

TEST(MarlinPlanner, IsThePlannerOfMarlin) {
  const auto planner = make_planner(Limits{}, marlin_config());
  EXPECT_NE(dynamic_cast<MarlinPlanner*>(planner.get()), nullptr);
}

TEST(MarlinPlanner, MotorsStopAtWholeSteps) {
  const auto moves = marlin_plan(polyline({{0.123, 1.007, 0.2012, 0.5}}, 50.0));
  ASSERT_EQ(moves.size(), 1U);
  EXPECT_DOUBLE_EQ(moves[0].segment.end_mm[X], 10.0 / 80.0);
  EXPECT_DOUBLE_EQ(moves[0].segment.end_mm[Y], 81.0 / 80.0);
  EXPECT_DOUBLE_EQ(moves[0].segment.end_mm[Z], 80.0 / 400.0);
  EXPECT_DOUBLE_EQ(moves[0].segment.end_mm[E], 0.5);  // the file's own
  EXPECT_DOUBLE_EQ(moves[0].segment.feed_mm_s, 50.0);
}

// stepper.cpp, block_phase_isr: acceleration acts from the second step on.
TEST(MarlinPlanner, MakesTheFirstStepOfALineAtItsEntryRate) {
  Limits limits = marlin_limits();
  limits.axis_max_accel_mm_s2 = {1e6, 1e6, 1e6, 1e6};
  limits.print_accel_mm_s2 = limits.travel_accel_mm_s2 = 1e6;
  limits.junction_deviation_mm = 0.3;
  std::vector<gcode::Segment> lines;
  gcode::Position at{};
  const std::array feeds_mm_s = {10.0, 20.0, 40.0, 80.0, 40.0};
  const std::array ends_mm = {0.1, 0.2, 0.4, 0.8, 1.2};
  for (std::size_t i = 0; i < feeds_mm_s.size(); ++i) {
    const gcode::Position to = {ends_mm[i], 0.0, 0.0, 0.0};
    lines.push_back(segment(at, to, feeds_mm_s[i]));
    at = to;
  }
  const auto moves = marlin_plan(lines, limits);
  ASSERT_EQ(moves.size(), 5U);
  // One step at the rate of the line before, the others at the line's own.
  EXPECT_NEAR(moves[0].duration_s(), 1.0 / 120.0 + 7.0 / 800.0, 2e-6);
  EXPECT_NEAR(moves[1].duration_s(), 1.0 / 800.0 + 7.0 / 1600.0, 2e-6);
  EXPECT_NEAR(moves[2].duration_s(), 1.0 / 1600.0 + 15.0 / 3200.0, 2e-6);
  EXPECT_NEAR(moves[3].duration_s(), 1.0 / 3200.0 + 31.0 / 6400.0, 2e-6);
  EXPECT_NEAR(moves[3].distance_mm(1.0 / 3200.0), kStep_mm, 1e-6);
  EXPECT_NEAR(moves[3].time_s(kStep_mm), 1.0 / 3200.0, 1e-6);
  EXPECT_NEAR(moves[4].duration_s(), 32.0 / 3200.0, 2e-5);
  limits.axis_jerk_mm_s = {1000.0, 1000.0, 1000.0, 1000.0};
  FirmwareConfig config = marlin_config();
  config.classic_jerk = true;
  const auto jerked = marlin_plan(lines, limits, config);
  EXPECT_NEAR(jerked[0].lead_s, 1.0 / 120.0, 1e-9);
  for (std::size_t i = 1; i < jerked.size(); ++i) {
    EXPECT_EQ(jerked[i].lead_s, 0.0);
  }
}

TEST(MarlinPlanner, RoundingDoesNotAddUp) {
  const auto moves = marlin_plan(dense_line(100, 0.1063, 50.0));
  ASSERT_EQ(moves.size(), 100U);
  for (std::size_t i = 0; i < moves.size(); ++i) {
    const double asked_mm = 0.1063 * static_cast<double>(i + 1);
    EXPECT_NEAR(moves[i].segment.end_mm[X], asked_mm, 0.5001 * kStep_mm) << i;
  }
}

TEST(MarlinPlanner, FewerThanSixStepsWaitForTheNextMove) {
  MarlinPlanner planner(marlin_limits(), marlin_config());
  EXPECT_TRUE(planner.add(segment({0, 0, 0, 0}, {0.075, 0, 0, 0}, 50.0)));
  EXPECT_FALSE(planner.add(segment({0.075, 0, 0, 0}, {0.1375, 0, 0, 0}, 50.0)));
  EXPECT_EQ(planner.pending(), 1U);
  EXPECT_TRUE(planner.add(segment({0.1375, 0, 0, 0}, {0.15, 0, 0, 0}, 50.0)));
  planner.stop();
  std::vector<PlannedMove> moves;
  ASSERT_EQ(planner.take(moves), 2U);
  EXPECT_DOUBLE_EQ(moves[1].segment.start_mm[X], 0.075);
  EXPECT_DOUBLE_EQ(moves[1].segment.end_mm[X], 0.15);
}

TEST(MarlinPlanner, StepsOfFilamentCountAsWellAndSetTheLengthOfTheFeed) {
  // 4 steps of X with 10 of E: the feed applies to the filament.
  const double e_mm = 10.0 / 93.0;
  const auto moves = marlin_plan({segment({0, 0, 0, 0}, {0.05, 0, 0, e_mm}, 2.0)});
  ASSERT_EQ(moves.size(), 1U);
  EXPECT_DOUBLE_EQ(moves[0].length_mm, 0.05);
  EXPECT_NEAR(moves[0].cruise_v_mm_s * e_mm / 0.05, 2.0, 2.0 / 93.0);
}

TEST(MarlinPlanner, MoveOfUnknownStartTaintsTheMoveItIsAddedTo) {
  MarlinPlanner planner(marlin_limits(), marlin_config());
  gcode::Segment unknown = segment({0, 0, 0, 0}, {0.05, 0, 0, 0}, 50.0);
  unknown.start_known = false;
  EXPECT_FALSE(planner.add(unknown));
  EXPECT_TRUE(planner.add(segment({0.05, 0, 0, 0}, {5, 0, 0, 0}, 50.0)));
  EXPECT_TRUE(planner.add(segment({5, 0, 0, 0}, {9, 0, 0, 0}, 50.0)));
  planner.stop();
  std::vector<PlannedMove> moves;
  ASSERT_EQ(planner.take(moves), 2U);
  EXPECT_FALSE(moves[0].segment.start_known);
  EXPECT_TRUE(moves[1].segment.start_known);
}

TEST(MarlinPlanner, MoveThatBeginsElsewhereBeginsThere) {
  MarlinPlanner planner(marlin_limits(), marlin_config());
  EXPECT_TRUE(planner.add(segment({0, 0, 0, 0}, {5, 0, 0, 0}, 50.0)));
  planner.stop();
  EXPECT_TRUE(planner.add(segment({100.001, 0, 0, 0}, {105, 0, 0, 0}, 50.0)));
  planner.stop();
  std::vector<PlannedMove> moves;
  ASSERT_EQ(planner.take(moves), 2U);
  EXPECT_DOUBLE_EQ(moves[1].segment.start_mm[X], 100.0);
}

TEST(MarlinPlanner, SingleMoveIsTheTrapezoidUpToOneStep) {
  const double v = 100.0;
  const double a = 3000.0;
  const auto moves = marlin_plan(polyline({{50, 0, 0, 0}}, v));
  ASSERT_EQ(moves.size(), 1U);
  EXPECT_DOUBLE_EQ(moves[0].start_v_mm_s, kSlowest_mm_s);
  EXPECT_DOUBLE_EQ(moves[0].cruise_v_mm_s, v);
  EXPECT_DOUBLE_EQ(moves[0].accel_s, (v - kSlowest_mm_s) / a);
  // Braking needs 133.3 steps, of which 133 are done.
  EXPECT_NEAR(moves[0].end_v_mm_s, std::sqrt(v * v - 2.0 * a * 133.0 * kStep_mm), 1e-9);
  EXPECT_NEAR(moves[0].decel_s, (v - moves[0].end_v_mm_s) / a, 1e-12);
}

// The first step out of a standstill takes 1/120 s, which counts as time of acceleration.
TEST(MarlinPlanner, SingleMoveLeapsBehindItsFirstStepAsItIsPlayed) {
  const double v = 100.0;
  const double a = 3000.0;
  auto moves = marlin_plan(polyline({{50, 0, 0, 0}}, v));
  ASSERT_EQ(moves.size(), 1U);
  const double planned_s = moves[0].duration_s();
  moves[0] = as_played(moves[0]);
  EXPECT_LT(moves[0].duration_s(), planned_s);
  EXPECT_DOUBLE_EQ(moves[0].start_v_mm_s, kSlowest_mm_s);
  EXPECT_DOUBLE_EQ(moves[0].cruise_v_mm_s, v);
  EXPECT_DOUBLE_EQ(moves[0].lead_s, 1.0 / 120.0);
  EXPECT_NEAR(moves[0].ramp_v_mm_s(), kSlowest_mm_s + a / 120.0, 0.5);
  EXPECT_NEAR(moves[0].ramp_up_mm_s2(), a, 0.01 * a);
  // Braking needs 133.3 steps, of which 133 are done, each at the rate at its beginning.
  EXPECT_NEAR(moves[0].end_v_mm_s, std::sqrt(v * v - 2.0 * a * 131.5 * kStep_mm), 3.0);
  EXPECT_NEAR(moves[0].ramp_down_mm_s2(), a, 0.02 * a);
  // The leap is part of the motion as a function of time and back.
  const double t = moves[0].lead_s + 0.4 * moves[0].accel_s;
  EXPECT_NEAR(moves[0].velocity_mm_s(t), 0.6 * moves[0].ramp_v_mm_s() + 0.4 * v, 1e-9);
  EXPECT_NEAR(moves[0].time_s(moves[0].distance_mm(t)), t, 1e-12);
  EXPECT_NEAR(moves[0].distance_mm(moves[0].lead_s), kStep_mm, 1e-12);
}

TEST(MarlinPlanner, CornerIsPassedByJunctionDeviation) {
  Limits limits = marlin_limits();
  limits.junction_deviation_mm = 0.05;
  const auto moves = marlin_plan(polyline({{20, 0, 0, 0}, {20, 20, 0, 0}}, 100.0), limits);
  ASSERT_EQ(moves.size(), 2U);
  const double sin_half = std::numbers::sqrt2 / 2.0;
  const double v = std::sqrt(3000.0 * 0.05 * sin_half / (1.0 - sin_half));
  EXPECT_NEAR(moves[1].start_v_mm_s, v, kRounding_mm_s);
}

TEST(MarlinPlanner, AccelerationAtTheCornerKeepsTheAxesLimits) {
  Limits limits = marlin_limits();
  limits.axis_max_accel_mm_s2[Y] = 300.0;
  const auto moves = marlin_plan(polyline({{20, 0, 0, 0}, {20, 20, 0, 0}}, 50.0), limits);
  ASSERT_EQ(moves.size(), 2U);
  const double sin_half = std::numbers::sqrt2 / 2.0;
  // The second block has 300 along Y, which at 45° gives less than Y's limit.
  const double v = std::sqrt(300.0 * 0.013 * sin_half / (1.0 - sin_half));
  EXPECT_NEAR(moves[1].start_v_mm_s, v, kRounding_mm_s);
  EXPECT_NEAR(moves[1].accel_mm_s2, 300.0, 1e-9);
}

TEST(MarlinPlanner, ReversalIsPassedAtTheSlowestRate) {
  const auto moves = marlin_plan(polyline({{20, 0, 0, 0}, {0, 0, 0, 0}}, 100.0));
  ASSERT_EQ(moves.size(), 2U);
  EXPECT_DOUBLE_EQ(moves[1].start_v_mm_s, kSlowest_mm_s);
}

TEST(MarlinPlanner, CollinearMovesArePassedAtTheLowerFeed) {
  auto segments = polyline({{20, 0, 0, 0}, {40, 0, 0, 0}, {60, 0, 0, 0}}, 100.0);
  segments[1].feed_mm_s = 60.0;
  const auto moves = marlin_plan(segments);
  ASSERT_EQ(moves.size(), 3U);
  EXPECT_NEAR(moves[1].start_v_mm_s, 60.0, kRounding_mm_s);
  EXPECT_NEAR(moves[2].start_v_mm_s, 60.0, kRounding_mm_s);
}

TEST(MarlinPlanner, ShortPiecesOfAnArcAreLimitedByItsRadius) {
  // A circle of 5 mm in 60 pieces of 0.52 mm; the acceleration on it is the block's, up to the
  // ±0.01 rad of the firmware's arccos on 6° = 0.105 rad.
  std::vector<gcode::Position> points;
  for (int i = 1; i <= 120; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / 60.0;
    points.push_back({5.0 * std::cos(angle) - 5.0, 5.0 * std::sin(angle), 0.0, 0.0});
  }
  Limits limits = marlin_limits();
  limits.junction_deviation_mm = 0.3;
  FirmwareConfig fine = marlin_config();
  fine.steps_per_mm = {3200.0, 3200.0, 400.0, 93.0};
  const auto moves = marlin_plan(polyline(points, 300.0), limits, fine);
  ASSERT_EQ(moves.size(), points.size());
  for (std::size_t i = 30; i < 90; ++i) {
    EXPECT_NEAR(moves[i].start_v_mm_s, std::sqrt(3000.0 * 5.0), 0.06 * std::sqrt(3000.0 * 5.0))
        << i;
  }
}

TEST(MarlinPlanner, ClassicJerkPassesACornerAtTheJerkOfAnAxis) {
  FirmwareConfig config = marlin_config();
  config.classic_jerk = true;
  Limits limits = marlin_limits();
  limits.axis_jerk_mm_s = {8.0, 8.0, 0.3, 5.0};
  const auto moves = marlin_plan(polyline({{20, 0, 0, 0}, {20, 20, 0, 0}}, 100.0), limits, config);
  ASSERT_EQ(moves.size(), 2U);
  EXPECT_NEAR(moves[1].start_v_mm_s, 8.0, kRounding_mm_s);
}

TEST(MarlinPlanner, ClassicJerkCountsTheFilament) {
  FirmwareConfig config = marlin_config();
  config.classic_jerk = true;
  Limits limits = marlin_limits();
  limits.axis_jerk_mm_s = {1000.0, 1000.0, 1000.0, 2.0};
  // E from none to 5 mm/s at 50 mm/s: 2 of 5 of the speed.
  const auto moves = marlin_plan(polyline({{20, 0, 0, 0}, {40, 0, 0, 2}}, 50.0), limits, config);
  ASSERT_EQ(moves.size(), 2U);
  EXPECT_NEAR(moves[1].start_v_mm_s, 20.0, kRounding_mm_s);
}

TEST(MarlinPlanner, AccelerationIsThatOfPrintTravelOrFilament) {
  Limits limits = marlin_limits();
  limits.print_accel_mm_s2 = 1000.0;
  limits.travel_accel_mm_s2 = 2000.0;
  limits.retract_accel_mm_s2 = 2500.0;
  const auto moves = marlin_plan(
      polyline({{20, 0, 0, 1}, {40, 0, 0, 1}, {40, 0, 0, 0}, {60, 0, 0, -1}}, 50.0), limits);
  ASSERT_EQ(moves.size(), 4U);
  EXPECT_NEAR(moves[0].accel_mm_s2, 1000.0, 0.02);
  EXPECT_NEAR(moves[1].accel_mm_s2, 2000.0, 0.02);
  EXPECT_NEAR(moves[2].accel_mm_s2, 2500.0, 0.02);
  EXPECT_NEAR(moves[3].accel_mm_s2, 1000.0, 0.02);  // a wipe takes filament
}

TEST(MarlinPlanner, FilamentAloneIsNotLimitedByItsAxis) {
  Limits limits = marlin_limits();
  limits.axis_max_accel_mm_s2[E] = 100.0;
  const auto moves = marlin_plan(polyline({{0, 0, 0, 5}}, 20.0), limits);
  ASSERT_EQ(moves.size(), 1U);
  EXPECT_NEAR(moves[0].accel_mm_s2, 3000.0, 0.02);
  EXPECT_FALSE(moves[0].kinematic);
  EXPECT_DOUBLE_EQ(moves[0].length_mm, 5.0);
}

TEST(MarlinPlanner, EachAxisKeepsItsSpeedAndAcceleration) {
  Limits limits = marlin_limits();
  limits.axis_max_velocity_mm_s = {100.0, 30.0, 5.0, 25.0};
  limits.axis_max_accel_mm_s2 = {3000.0, 500.0, 100.0, 10000.0};
  const auto moves = marlin_plan(polyline({{30, 40, 0, 0}}, 90.0), limits);
  ASSERT_EQ(moves.size(), 1U);
  EXPECT_NEAR(moves[0].cruise_v_mm_s, 30.0 / 0.8, kRounding_mm_s);
  EXPECT_NEAR(moves[0].accel_mm_s2, 500.0 / 0.8, 0.02);
}

TEST(MarlinPlanner, FilamentKeepsItsSpeedInAMove) {
  Limits limits = marlin_limits();
  limits.axis_max_velocity_mm_s[E] = 25.0;
  const auto moves = marlin_plan(polyline({{40, 0, 0, 20}}, 90.0), limits);
  ASSERT_EQ(moves.size(), 1U);
  EXPECT_NEAR(moves[0].cruise_v_mm_s, 50.0, kRounding_mm_s);
}

TEST(MarlinPlanner, FeedsBelowTheMinimumAreRaised) {
  Limits limits = marlin_limits();
  limits.min_velocity_mm_s = 8.0;
  limits.min_travel_velocity_mm_s = 12.0;
  const auto moves = marlin_plan(polyline({{20, 0, 0, 1}, {40, 0, 0, 1}}, 3.0), limits);
  ASSERT_EQ(moves.size(), 2U);
  EXPECT_NEAR(moves[0].cruise_v_mm_s, 8.0, kRounding_mm_s);
  EXPECT_NEAR(moves[1].cruise_v_mm_s, 12.0, kRounding_mm_s);
}

TEST(MarlinPlanner, LimitsHoldFromWhereTheyStand) {
  MarlinPlanner planner(marlin_limits(), marlin_config());
  EXPECT_TRUE(planner.add(segment({0, 0, 0, 0}, {20, 0, 0, 0}, 50.0)));
  gcode::LimitChange change;
  change.travel_accel_mm_s2 = 700.0;
  planner.apply(change);
  EXPECT_TRUE(planner.add(segment({20, 0, 0, 0}, {40, 0, 0, 0}, 50.0)));
  planner.stop();
  std::vector<PlannedMove> moves;
  ASSERT_EQ(planner.take(moves), 2U);
  EXPECT_NEAR(moves[0].accel_mm_s2, 3000.0, 0.02);
  EXPECT_NEAR(moves[1].accel_mm_s2, 700.0, 0.02);
}

// A block that begins to run knows N − 3 others, and the last of them ends at rest.
class MarlinHorizon : public ::testing::TestWithParam<int> {};

TEST_P(MarlinHorizon, SpeedOfADenseLineIsWhatTheBufferCanBrake) {
  FirmwareConfig config = marlin_config();
  config.block_buffer_size = GetParam();
  const double piece_mm = 0.2;
  const auto moves = marlin_plan(dense_line(200, piece_mm, 400.0), marlin_limits(), config);
  ASSERT_EQ(moves.size(), 200U);
  const double braking_mm = piece_mm * (GetParam() - 3);
  EXPECT_NEAR(moves[101].start_v_mm_s, std::sqrt(2.0 * 3000.0 * braking_mm), 2.0 * kRounding_mm_s);
}

INSTANTIATE_TEST_SUITE_P(Buffers, MarlinHorizon, ::testing::Values(4, 8, 16, 32));

TEST(MarlinPlanner, BlocksComeOutOnceTheBufferIsFullBehindThem) {
  MarlinPlanner planner(marlin_limits(), marlin_config());
  const auto segments = dense_line(17, 1.0, 50.0);
  std::vector<PlannedMove> moves;
  for (std::size_t i = 0; i < 15; ++i) ASSERT_TRUE(planner.add(segments[i]));
  EXPECT_EQ(planner.take(moves), 0U);
  ASSERT_TRUE(planner.add(segments[15]));
  EXPECT_EQ(planner.take(moves), 2U);  // the first has run, the second runs
  ASSERT_TRUE(planner.add(segments[16]));
  EXPECT_EQ(planner.take(moves), 1U);
  EXPECT_EQ(planner.pending(), 14U);
}

TEST(MarlinPlanner, ShortMovesAfterAStopAreStretched) {
  Limits limits = marlin_limits();
  limits.min_segment_time_s = 0.02;
  const auto moves = marlin_plan(dense_line(60, 0.2, 20.0), limits);
  ASSERT_EQ(moves.size(), 60U);
  // The third finds two blocks in the buffer: 10 ms + 2 · (20 − 10) ms / 2; the eighth, seven.
  EXPECT_NEAR(moves[2].cruise_v_mm_s, 0.2 / 0.020, kRounding_mm_s);
  EXPECT_NEAR(moves[7].cruise_v_mm_s, 0.2 / (0.010 + 0.020 / 7.0), kRounding_mm_s);
  EXPECT_NEAR(moves[1].cruise_v_mm_s, 20.0, kRounding_mm_s);
  for (std::size_t i = 8; i < 50; ++i) {
    EXPECT_NEAR(moves[i].cruise_v_mm_s, 20.0, kRounding_mm_s) << i;
  }
  const auto untouched = marlin_plan(dense_line(60, 0.2, 20.0));
  EXPECT_LT(duration_s(untouched), duration_s(moves) - 0.02);
}

TEST(MarlinPlanner, RatesBelowTheSlowestHaveNoRamps) {
  const auto moves = marlin_plan(polyline({{5, 0, 0, 0}}, 1.0));
  ASSERT_EQ(moves.size(), 1U);
  EXPECT_DOUBLE_EQ(moves[0].duration_s(), 5.0);
}

// The moves take longer than 32 bits of microseconds can hold, while the queue is still filling and
// moves are stretched.
TEST(MarlinPlanner, MovesOfHoursAreNotStretched) {
  Limits limits = marlin_limits();
  limits.min_segment_time_s = 0.02;
  const auto moves = marlin_plan(dense_line(6, 300.0, 0.1), limits);
  ASSERT_EQ(moves.size(), 6U);
  for (const PlannedMove& move : moves) {
    EXPECT_NEAR(move.duration_s(), 3000.0, 400.0);  // at whole steps per second
  }
}

// X and Y turn back exactly. A step of E in one of the two lines keeps the firmware's vector in X,
// Y, Z and E from turning back, so that it does not slow down. Which lines have one depends on what
// E reads: here 0.2 steps a line, from two zeros.
TEST(MarlinPlanner, ReadingOfEDecidesWhetherLinesThatTurnBackStop) {
  Limits limits = marlin_limits();
  limits.print_accel_mm_s2 = limits.travel_accel_mm_s2 = 1e6;
  limits.axis_max_accel_mm_s2 = {1e6, 1e6, 1e6, 1e6};
  limits.junction_deviation_mm = 0.3;
  const auto entry_mm_s = [&](double steps_at_start) {
    std::vector<gcode::Segment> lines =
        polyline({{0.2, 0, 0, 0.2 / 93.0}, {0, 0, 0, 0.4 / 93.0}, {0, 1, 0, 0.4 / 93.0}}, 40.0);
    for (gcode::Segment& line : lines) {
      const auto reading = [&](const gcode::Position& position) {
        return static_cast<float>(position[E] + steps_at_start / 93.0);
      };
      line.reading_of_e = gcode::ReadingOfE{reading(line.start_mm), reading(line.end_mm)};
    }
    return marlin_plan(lines, limits)[1].start_v_mm_s;
  };
  EXPECT_LT(entry_mm_s(0.0), 2.0);          // no step
  EXPECT_NEAR(entry_mm_s(0.2), 40.0, 0.1);  // one in the second line
  EXPECT_NEAR(entry_mm_s(0.4), 40.0, 0.1);  // one in the first
}

// G92 E0 drops what was left of a step.
TEST(MarlinPlanner, WhereEIsSetItIsRoundedAnew) {
  std::vector<gcode::Segment> lines =
      polyline({{1, 0, 0, 0.4 / 93.0}, {2, 0, 0, 0.8 / 93.0}, {3, 0, 0, 1.2 / 93.0}}, 40.0);
  for (gcode::Segment& line : lines) {
    line.reading_of_e = gcode::ReadingOfE{0.0F, static_cast<float>(0.4 / 93.0)};
  }
  for (const PlannedMove& move : marlin_plan(lines)) EXPECT_EQ(move.direction[E], 0.0);
  lines[1].reading_of_e =
      gcode::ReadingOfE{static_cast<float>(0.4 / 93.0), static_cast<float>(0.8 / 93.0)};
  EXPECT_GT(marlin_plan(lines)[1].direction[E], 0.0);
}

// M221 S50 halves the steps of the reading, not the reading.
TEST(MarlinPlanner, FlowFactorActsOnWholeSteps) {
  std::vector<gcode::Segment> lines = polyline({{1, 0, 0, 1.5 / 93.0}}, 40.0);
  lines[0].reading_of_e = gcode::ReadingOfE{0.0F, static_cast<float>(3.0 / 93.0), 0.5F};
  EXPECT_NEAR(marlin_plan(lines)[0].direction[E], 1.5 / 93.0, 1e-9);
}

TEST(MarlinPlanner, LimitsBeyondTheFirmwaresIntegersAreTheirLargest) {
  Limits limits = marlin_limits();
  limits.axis_max_accel_mm_s2 = {1e12, 1e12, 1e12, 1e12};
  limits.print_accel_mm_s2 = limits.travel_accel_mm_s2 = 1e12;
  limits.min_segment_time_s = 1e12;
  const auto moves = marlin_plan(dense_line(8, 10.0, 100.0), limits);
  ASSERT_EQ(moves.size(), 8U);
  EXPECT_GT(moves[0].accel_mm_s2, 4e7);  // 2³² steps/s²
  for (const PlannedMove& move : moves) EXPECT_TRUE(std::isfinite(move.duration_s()));
}

TEST(MarlinPlanner, PlacesBeyondTheFirmwaresStepsAreReached) {
  const auto moves = marlin_plan(polyline({{1e8, 0, 0, 0}, {-1e8, 0, 0, 6e6}}, 1000.0));
  ASSERT_EQ(moves.size(), 2U);
  EXPECT_NEAR(moves[1].segment.start_mm[X], 1e8, 10.0);
  EXPECT_NEAR(moves[1].segment.end_mm[X], -1e8, 10.0);
  EXPECT_NEAR(moves[1].length_mm, 2e8, 20.0);
}

}  // namespace
}  // namespace unflex::planner
