// Marlin's and RepRapFirmware's rules for motors that move two axes, against closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "planner/marlin_helpers.hpp"
#include "planner/plan_helpers.hpp"
#include "planner/rrf_limits.hpp"
#include "unflex/planner/rrf_planner.hpp"

namespace unflex::planner {
namespace {

using enum gcode::Axis;
using testing::marlin_config;
using testing::marlin_limits;
using testing::marlin_plan;
using testing::polyline;

FirmwareConfig rrf_config() {
  FirmwareConfig config;
  config.firmware = Firmware::rrf;
  return config;
}

Limits fast_limits() {
  Limits limits = testing::rrf_default_limits();
  limits.axis_max_velocity_mm_s = {300.0, 300.0, 20.0, 100.0};
  limits.axis_max_accel_mm_s2 = {3000.0, 3000.0, 200.0, 5000.0};
  limits.jerk_policy = 1;
  return limits;
}

std::vector<PlannedMove> rrf_plan(const std::vector<gcode::Segment>& segments, const Limits& limits,
                                  const FirmwareConfig& config) {
  RrfPlanner planner(limits, config);
  for (const gcode::Segment& each : segments) planner.add(each);
  planner.stop();
  std::vector<PlannedMove> moves;
  planner.take(moves);
  return moves;
}

// At 45° one motor of a CoreXY moves √2 times the length, and the other stands.
TEST(MarlinOnACoreXy, LimitsMotors) {
  FirmwareConfig core = marlin_config();
  core.motors = Motors(Kinematics::corexy, core.firmware);
  Limits limits = marlin_limits();
  limits.axis_max_accel_mm_s2 = {5000.0, 5000.0, 100.0, 10000.0};
  limits.axis_max_velocity_mm_s = {200.0, 200.0, 10.0, 100.0};
  limits.print_accel_mm_s2 = limits.travel_accel_mm_s2 = 20000.0;
  const double half = std::sqrt(0.5);
  const auto line = [&](double x, double y, const FirmwareConfig& config) {
    return marlin_plan(polyline({{80.0 * x, 80.0 * y, 0.0, 0.0}}, 1000.0), limits, config).at(0);
  };
  EXPECT_NEAR(line(half, half, core).accel_mm_s2, 3535.5, 1.0);
  EXPECT_NEAR(line(half, -half, core).accel_mm_s2, 3535.5, 1.0);
  EXPECT_NEAR(line(half, half, core).cruise_v_mm_s, 141.42, 0.05);
  EXPECT_NEAR(line(1.0, 0.0, core).accel_mm_s2, 5000.0, 1.0);
  EXPECT_NEAR(line(0.8, 0.6, core).accel_mm_s2, 5000.0 / 1.4, 1.0);
  EXPECT_NEAR(line(half, half, marlin_config()).accel_mm_s2, 7071.0, 1.0);
  // The positions are those of X and Y, as without shared motors.
  const PlannedMove move = line(0.8, 0.6, core);
  EXPECT_NEAR(move.length_mm, 80.0, 1e-9);
  EXPECT_NEAR(move.segment.end_mm[X], 64.0, 1e-9);
}

// A right angle in X and Y turns the motors by as much: from A = B to A = −B.
TEST(MarlinOnACoreXy, JoinsLinesByTheirMotorsDirections) {
  FirmwareConfig core = marlin_config();
  core.motors = Motors(Kinematics::corexy, core.firmware);
  Limits limits = marlin_limits();
  limits.print_accel_mm_s2 = limits.travel_accel_mm_s2 = 1000.0;
  const auto corner = [&](const FirmwareConfig& config) {
    return marlin_plan(polyline({{40, 0, 0, 0}, {40, 40, 0, 0}}, 100.0), limits, config)
        .at(0)
        .end_v_mm_s;
  };
  EXPECT_NEAR(corner(core), corner(marlin_config()), 0.01);
  // A line along X and Z: the motors' motion along X is √2 times as long, so the direction turns
  // less. The tangent of the angle is 1/√2 instead of 1.
  const auto ramp = [&](const FirmwareConfig& config) {
    return marlin_plan(polyline({{40, 0, 0, 0}, {80, 0, 40, 0}}, 100.0), limits, config)
        .at(1)
        .start_v_mm_s;
  };
  const auto speed = [&](double turn) {
    const double s = std::cos(0.5 * turn);
    return std::sqrt(1000.0 * limits.junction_deviation_mm * s / (1.0 - s));
  };
  EXPECT_NEAR(ramp(core), speed(std::atan(std::sqrt(0.5))), 0.1);
  EXPECT_NEAR(ramp(marlin_config()), speed(std::atan(1.0)), 0.1);
}

TEST(MarlinOnACoreXy, CountsMotorsStepsForTheShortestLine) {
  FirmwareConfig core = marlin_config();
  core.motors = Motors(Kinematics::corexy, core.firmware);
  // Three steps along both axes are six of one motor.
  const auto moves = polyline({{3.0 / 80.0, 3.0 / 80.0, 0.0, 0.0}}, 50.0);
  EXPECT_EQ(marlin_plan(moves, marlin_limits(), core).size(), 1U);
  EXPECT_EQ(marlin_plan(moves, marlin_limits(), marlin_config()).size(), 0U);
}

TEST(RrfOnACoreXy, LimitsMotorsToo) {
  FirmwareConfig core = rrf_config();
  core.motors = Motors(Kinematics::corexy, core.firmware);
  Limits limits = fast_limits();
  limits.axis_max_accel_mm_s2 = {5000.0, 5000.0, 200.0, 5000.0};
  const double half = std::sqrt(0.5);
  const auto line = [&](double x, double y, const FirmwareConfig& config) {
    return rrf_plan(polyline({{80.0 * x, 80.0 * y, 0.0, 0.0}}, 1000.0), limits, config).at(0);
  };
  EXPECT_NEAR(line(half, half, core).accel_mm_s2, 3535.53, 0.1);
  EXPECT_NEAR(line(-half, half, core).accel_mm_s2, 3535.53, 0.1);
  EXPECT_NEAR(line(half, half, core).cruise_v_mm_s, 300.0 * half, 0.01);
  EXPECT_NEAR(line(0.0, 1.0, core).accel_mm_s2, 5000.0, 0.1);
  EXPECT_NEAR(line(half, half, rrf_config()).accel_mm_s2, 7071.07, 0.1);
}

// CoreKinematics.cpp: the Z motors of a coreXZ turn three times as far for Z, and Z's limits are
// those of a motor that X needs.
TEST(RrfOnACoreXz, LimitsXByZsMotor) {
  FirmwareConfig core = rrf_config();
  core.motors = Motors(Kinematics::corexz, core.firmware);
  const auto line = [&](gcode::Position to) {
    return rrf_plan(polyline({to}, 1000.0), fast_limits(), core).at(0);
  };
  EXPECT_NEAR(line({50, 0, 0, 0}).accel_mm_s2, 200.0, 0.01);
  EXPECT_NEAR(line({50, 0, 0, 0}).cruise_v_mm_s, 20.0, 0.01);
  EXPECT_NEAR(line({0, 50, 0, 0}).accel_mm_s2, 3000.0, 0.1);
  EXPECT_NEAR(line({0, 0, 50, 0}).accel_mm_s2, 200.0 / 3.0, 0.01);
}

// CoreKinematics.cpp: motor i is held to the limits of axis i, for the directions without signs. So
// Z's limits are those of the slider C, which X needs and Y does not.
TEST(RrfOnATripteron, LimitsEachSlider) {
  FirmwareConfig machine = rrf_config();
  machine.motors = Motors(Kinematics::tripteron, machine.firmware);
  const auto accel_mm_s2 = [&](gcode::Position to) {
    return rrf_plan(polyline({to}, 1000.0), fast_limits(), machine).at(0).accel_mm_s2;
  };
  EXPECT_NEAR(accel_mm_s2({50, 0, 0, 0}), 200.0, 0.01);
  EXPECT_NEAR(accel_mm_s2({0, 50, 0, 0}), 3000.0, 0.1);
  EXPECT_NEAR(accel_mm_s2({50, 50, 0, 0}), 200.0 * std::sqrt(2.0), 0.1);
}

TEST(RrfOnATripteron, IsWhereItsMotorsStepsAre) {
  FirmwareConfig machine = rrf_config();
  machine.motors = Motors(Kinematics::tripteron, machine.firmware);
  machine.steps_per_mm = {80.0, 80.0, 80.0, 420.0};
  const PlannedMove move =
      rrf_plan(polyline({{10.0 + 0.4 / 80.0, 5.0 + 0.3 / 80.0, 0.0, 0.0}}, 50.0), fast_limits(),
               machine)
          .at(0);
  // The sliders are at 1200.7, 400.1 and 800.4 steps: 1201, 400 and 800.
  EXPECT_NEAR(move.segment.end_mm[X], 0.25 * (1201.0 + 400.0 + 2.0 * 800.0) / 80.0, 1e-9);
  EXPECT_NEAR(move.segment.end_mm[Y], 0.5 * (1201.0 - 400.0) / 80.0, 1e-9);
  EXPECT_NEAR(move.segment.end_mm[Z], 0.25 * (-1201.0 - 400.0 + 2.0 * 800.0) / 80.0, 1e-9);
}

TEST(RrfOnACoreXy, IsWhereItsMotorsStepsAre) {
  FirmwareConfig core = rrf_config();
  core.motors = Motors(Kinematics::corexy, core.firmware);
  core.steps_per_mm = {80.0, 80.0, 400.0, 420.0};
  const PlannedMove move =
      rrf_plan(polyline({{10.0 + 0.4 / 80.0, 5.0 + 0.3 / 80.0, 0.0, 0.0}}, 50.0), fast_limits(),
               core)
          .at(0);
  // A is at 1200.7 steps, B at 400.1: 1201 and 400, so that X and Y end on half steps.
  EXPECT_NEAR(move.segment.end_mm[X], 800.5 / 80.0, 1e-9);
  EXPECT_NEAR(move.segment.end_mm[Y], 400.5 / 80.0, 1e-9);
}

// Klipper limits only the tool, not the motors (klippy/toolhead.py).
TEST(KlipperOnACoreXy, PlansAsOnAnyMachine) {
  FirmwareConfig core;
  core.motors = Motors(Kinematics::corexy, core.firmware);
  EXPECT_EQ(testing::plan(polyline({{50, 50, 0, 0}}, 1000.0), Limits{}, core).at(0).accel_mm_s2,
            5000.0);
}

}  // namespace
}  // namespace unflex::planner
