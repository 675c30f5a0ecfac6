#include "run_check.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "replaying.hpp"

namespace unflex::verify {
namespace {

// A move along X at constant speed, or from one speed to another.
planner::PlannedMove along_x(double start_mm, double length_mm, double from_mm_s, double to_mm_s) {
  planner::PlannedMove move;
  move.segment.start_mm[gcode::X] = start_mm;
  move.segment.end_mm[gcode::X] = start_mm + length_mm;
  move.direction[gcode::X] = 1.0;
  move.length_mm = length_mm;
  move.start_v_mm_s = from_mm_s;
  move.cruise_v_mm_s = std::max(from_mm_s, to_mm_s);
  move.end_v_mm_s = to_mm_s;
  move.accel_s = 2.0 * length_mm / (from_mm_s + to_mm_s);
  move.accel_mm_s2 = (to_mm_s - from_mm_s) / move.accel_s;
  return move;
}

class OfRuns : public ::testing::Test {
 protected:
  Rules rules_;
  Violations violations_{"", ""};
  BaseCheck check_{rules_, violations_};
};

TEST_F(OfRuns, TheLargestStepOfSpeedIsBetweenLines) {
  check_.begin_run();
  check_.add(along_x(0.0, 1.0, 10.0, 10.0));
  check_.add(along_x(1.0, 1.0, 32.0, 32.0));
  check_.add(along_x(2.0, 1.0, 11.0, 11.0));
  check_.end_run();
  EXPECT_DOUBLE_EQ(check_.max_step_mm_s(), 22.0);
}

TEST_F(OfRuns, StepsOfSpeedCountWhereARunMeetsKeptMotion) {
  check_.add_kept(along_x(0.0, 1.0, 100.0, 100.0));
  check_.begin_run();
  check_.add(along_x(1.0, 1.0, 70.0, 70.0));
  check_.end_run();
  EXPECT_DOUBLE_EQ(check_.max_step_mm_s(), 30.0);
  check_.add_kept(along_x(2.0, 1.0, 110.0, 110.0));
  EXPECT_DOUBLE_EQ(check_.max_step_mm_s(), 40.0);
  // Between kept moves the firmware does as it would without unflex.
  check_.add_kept(along_x(3.0, 1.0, 10.0, 10.0));
  EXPECT_DOUBLE_EQ(check_.max_step_mm_s(), 40.0);
}

TEST_F(OfRuns, TheLimitInForceFollowsThePlanThatAsksForMost) {
  rules_.base_max_accel_mm_s2 = 6000.0;
  rules_.base_accel_times_plan = 2.0;
  planner::PlannedMove asks = along_x(0.0, 1.0, 10.0, 50.0);
  asks.accel_mm_s2 = 4000.0;
  check_.begin_run();
  check_.add_planned(asks);
  check_.end_run();
  check_.begin_run();
  check_.end_run();
  EXPECT_DOUBLE_EQ(check_.accel_limit_mm_s2(), 6000.0);
  EXPECT_DOUBLE_EQ(check_.largest_accel_limit_mm_s2(), 8000.0);
}

}  // namespace
}  // namespace unflex::verify
