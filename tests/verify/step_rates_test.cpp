#include "unflex/verify/step_rates.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "unflex/verify/verify.hpp"

namespace unflex::verify {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

planner::FirmwareConfig machine_of(Kinematics kinematics) {
  planner::FirmwareConfig fixed;
  fixed.motors = Motors(kinematics, fixed.firmware);
  return fixed;
}

StepRules steps(double x, double y, double z = 0.0, double e = 0.0) {
  StepRules rules;
  rules.steps_per_mm = {x, y, z, e};
  return rules;
}

// A second in X, Y and E at an even speed, in line 7.
planner::PlannedMove even_move(double x_mm_s, double y_mm_s, double e_mm_s = 0.0) {
  planner::PlannedMove move;
  move.segment.line = 7;
  move.segment.end_mm = {x_mm_s, y_mm_s, 0.0, e_mm_s};
  const double v = std::hypot(x_mm_s, y_mm_s);
  move.direction = {x_mm_s / v, y_mm_s / v, 0.0, e_mm_s / v};
  move.length_mm = v;
  move.start_v_mm_s = move.end_v_mm_s = move.cruise_v_mm_s = v;
  move.cruise_s = 1.0;
  return move;
}

// A second of filament alone.
planner::PlannedMove feed(double e_mm_s) {
  planner::PlannedMove move;
  move.segment.line = 8;
  move.segment.end_mm = {0.0, 0.0, 0.0, e_mm_s};
  move.kinematic = false;
  move.direction = {0.0, 0.0, 0.0, std::copysign(1.0, e_mm_s)};
  move.length_mm = move.cruise_v_mm_s = std::abs(e_mm_s);
  move.cruise_s = 1.0;
  return move;
}

TEST(StepRates, AreSpeedTimesStepsPerMm) {
  for (const auto& [steps_per_mm, hz] :
       {std::pair(80.0, 48000.0), std::pair(160.0, 96000.0), std::pair(400.0, 240000.0)}) {
    StepGauge gauge(machine_of(Kinematics::cartesian), steps(steps_per_mm, steps_per_mm));
    gauge.play(even_move(-600.0, 0.0));
    EXPECT_DOUBLE_EQ(gauge.largest().motors[0].hz, hz);
    EXPECT_EQ(gauge.largest().motors[0].line, 7U);
    EXPECT_EQ(gauge.largest().motors[1].hz, 0.0);
    EXPECT_EQ(gauge.largest().motors[1].line, 0U);
  }
}

TEST(StepRates, OfACoreXyAreThoseOfItsMotors) {
  StepGauge gauge(machine_of(Kinematics::corexy), steps(80.0, 80.0));
  const double along = 300.0 / std::sqrt(2.0);
  gauge.play(even_move(along, along));
  EXPECT_NEAR(gauge.largest().motors[0].hz, 33941.0, 0.2);
  EXPECT_NEAR(gauge.largest().motors[1].hz, 0.0, 1e-6);
  EXPECT_EQ(gauge.largest().names[0], "A");
  EXPECT_EQ(gauge.largest().names[1], "B");
}

TEST(StepRates, AreTakenWhereALineIsFastest) {
  StepGauge gauge(machine_of(Kinematics::cartesian), steps(80.0, 80.0));
  planner::PlannedMove move = even_move(100.0, 0.0);
  move.start_v_mm_s = 10.0;
  move.end_v_mm_s = 20.0;
  gauge.play(move);
  EXPECT_DOUBLE_EQ(gauge.largest().motors[0].hz, 8000.0);
}

TEST(StepRates, CountFilamentAloneAndAlongAPath) {
  StepGauge gauge(machine_of(Kinematics::cartesian), steps(80.0, 80.0, 400.0, 500.0));
  gauge.play(even_move(100.0, 0.0, 5.0));
  EXPECT_NEAR(gauge.largest().motors[3].hz, 2500.0, 1e-9);
  EXPECT_NEAR(gauge.largest().shared.hz, 10500.0, 1e-9);
  gauge.play(feed(-40.0));
  EXPECT_NEAR(gauge.largest().motors[3].hz, 20000.0, 1e-9);
  EXPECT_EQ(gauge.largest().motors[3].line, 8U);
  EXPECT_NEAR(gauge.largest().total.hz, 20000.0, 1e-9);
  EXPECT_NEAR(gauge.largest().shared.hz, 10500.0, 1e-9);
}

TEST(StepRates, AreNoneWhereNoStepsAreKnown) {
  StepRules rules;
  rules.max_hz = 1.0;
  StepGauge gauge(machine_of(Kinematics::cartesian), rules);
  gauge.play(even_move(100.0, 100.0));
  EXPECT_EQ(gauge.largest().total.hz, 0.0);
  EXPECT_THAT(gauge.breaches(), IsEmpty());
}

TEST(StepLimits, AreBrokenByTheLineThatHasTheLargestRate) {
  StepRules rules = steps(80.0, 80.0);
  rules.max_hz = 8001.0;
  StepGauge gauge(machine_of(Kinematics::cartesian), rules);
  gauge.play(even_move(100.0, 0.0));
  EXPECT_THAT(gauge.breaches(), IsEmpty());
  planner::PlannedMove faster = even_move(120.0, 0.0);
  faster.segment.line = 12;
  gauge.play(faster);
  ASSERT_THAT(gauge.breaches(), SizeIs(1));
  EXPECT_EQ(gauge.breaches().front().line, 12U);
  EXPECT_THAT(gauge.breaches().front().message,
              HasSubstr("motor X makes 9600 steps per second, and its limit is 8001"));
  gauge.clear();
  EXPECT_THAT(gauge.breaches(), IsEmpty());
}

TEST(StepLimits, OfAllMotorsCountTheirSum) {
  StepRules rules = steps(80.0, 80.0);
  rules.max_total_hz = rules.max_shared_hz = 15000.0;
  StepGauge gauge(machine_of(Kinematics::cartesian), rules);
  gauge.play(even_move(100.0, 100.0));
  ASSERT_THAT(gauge.breaches(), SizeIs(1));
  EXPECT_THAT(gauge.breaches().front().message,
              HasSubstr("all motors together make 16000 steps per second"));
}

// A processor makes more steps for one motor than for several.
TEST(StepLimits, OfMotorsThatShareAProcessorSpareOneAlone) {
  StepRules rules = steps(80.0, 80.0);
  rules.max_shared_hz = 15000.0;
  StepGauge gauge(machine_of(Kinematics::cartesian), rules);
  gauge.play(even_move(200.0, 0.0));
  EXPECT_THAT(gauge.breaches(), IsEmpty());
  gauge.play(even_move(100.0, 100.0));
  EXPECT_THAT(gauge.breaches(), SizeIs(1));
}

TEST(StepLimits, AreRulesOfARun) {
  Rules rules;
  rules.base_max_velocity_mm_s = rules.base_max_accel_mm_s2 = 1e9;
  const planner::PlannedMove move = even_move(100.0, 0.0);
  rules.steps = steps(80.0, 80.0);
  EXPECT_EQ(broken_rule({move}, {move}, rules), std::nullopt);
  rules.steps.max_hz = 7900.0;
  EXPECT_THAT(broken_rule({move}, {move}, rules).value_or(""), HasSubstr("motor X makes 8000"));
}

}  // namespace
}  // namespace unflex::verify
