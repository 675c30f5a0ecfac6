// Marlin's limits, modes of E, factors, volumes and retraction.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include "interpreting.hpp"

namespace unflex::gcode {
namespace {

using ::testing::IsEmpty;
using ::testing::SizeIs;

Session marlin() { return Session(default_options(Firmware::marlin)); }

Session retracting(double hop_mm = 0.0) {
  InterpreterOptions options = default_options(Firmware::marlin);
  options.firmware_retraction = true;
  options.retract_z_hop_mm = hop_mm;
  return Session(options);
}

TEST(MarlinLimits, OfAxesAreInUnitsPerSecond) {
  Session session = marlin();
  Event event = session.read("M201 X1250 Y1000 Z200 E5000");
  EXPECT_EQ(event.kind, EventKind::limits);
  EXPECT_EQ(event.limits->axis_max_accel_mm_s2, (AxisValues{1250.0, 1000.0, 200.0, 5000.0}));
  event = session.read("M203 X200 E120");
  EXPECT_EQ(event.limits->axis_max_velocity_mm_s,
            (AxisValues{200.0, std::nullopt, std::nullopt, 120.0}));
  EXPECT_EQ(event.limits->max_velocity_mm_s, std::nullopt);
  session.read("G20");
  EXPECT_DOUBLE_EQ(*session.read("M203 X2").limits->axis_max_velocity_mm_s[X], 50.8);
}

TEST(MarlinLimits, OfM204TellApartPrintTravelAndRetraction) {
  Session session = marlin();
  Event event = session.read("M204 P800 R1250 T1500");
  EXPECT_EQ(event.kind, EventKind::limits);
  EXPECT_EQ(event.limits->print_accel_mm_s2, 800.0);
  EXPECT_EQ(event.limits->retract_accel_mm_s2, 1250.0);
  EXPECT_EQ(event.limits->travel_accel_mm_s2, 1500.0);
  EXPECT_EQ(event.limits->max_accel_mm_s2, std::nullopt);
  event = session.read("M204 S900");
  EXPECT_EQ(event.limits->print_accel_mm_s2, 900.0);
  EXPECT_EQ(event.limits->travel_accel_mm_s2, 900.0);
  EXPECT_EQ(event.limits->retract_accel_mm_s2, std::nullopt);
  event = session.read("M204 P700");
  EXPECT_EQ(event.limits->print_accel_mm_s2, 700.0);
  EXPECT_EQ(event.limits->travel_accel_mm_s2, std::nullopt);
  event = session.read("M204 S900 T1200");
  EXPECT_EQ(event.limits->print_accel_mm_s2, 900.0);
  EXPECT_EQ(event.limits->travel_accel_mm_s2, 1200.0);
}

TEST(MarlinLimits, OfM205AreTheAdvancedSettings) {
  Session session = marlin();
  const Event event = session.read("M205 B20000 S1 T2 X8 Y9 Z0.4 E4.5 J0.02");
  EXPECT_EQ(event.kind, EventKind::limits);
  EXPECT_DOUBLE_EQ(*event.limits->min_segment_time_s, 0.02);
  EXPECT_EQ(event.limits->min_velocity_mm_s, 1.0);
  EXPECT_EQ(event.limits->min_travel_velocity_mm_s, 2.0);
  EXPECT_EQ(event.limits->axis_jerk_mm_s, (AxisValues{8.0, 9.0, 0.4, 4.5}));
  EXPECT_EQ(event.limits->junction_deviation_mm, 0.02);
  EXPECT_EQ(session.read("M205 B0").limits->min_segment_time_s, 0.0);
  EXPECT_EQ(session.read("M205 S0 T0").warnings.size(), 0U);
}

TEST(MarlinLimits, ThatAreInvalidChangeNothing) {
  Session session = marlin();
  for (const char* line : {"M201 X0", "M203 Y-5", "M204 P0", "M204 T", "M205 J0.5", "M205 J0.001",
                           "M205 B-1", "M220 S0", "M221 S-3", "M200 D-1"}) {
    const Event event = session.read(line);
    EXPECT_EQ(event.kind, EventKind::passive) << line;
    EXPECT_THAT(event.warnings, SizeIs(1)) << line;
  }
}

// gcode.h, set_relative_mode: the later word wins.
TEST(MarlinExtrusionMode, FollowsG90AndG91UntilM82OrM83) {
  Session session = marlin();
  session.read("G1 X1 Y1 Z1 E10");
  EXPECT_DOUBLE_EQ(session.move("M83\nG1 X2 E1").delta(E), 1.0);
  EXPECT_DOUBLE_EQ(session.move("G90\nG1 X3 E12").delta(E), 1.0) << "G90 makes E absolute again";
  EXPECT_DOUBLE_EQ(session.move("G91\nG1 X3 E2").delta(E), 2.0);
  EXPECT_DOUBLE_EQ(session.move("M82\nG1 X3 E15").delta(E), 1.0) << "M82 under G91";
  EXPECT_TRUE(session.state().e_is_absolute());
  EXPECT_FALSE(session.state().absolute_xyz);
  EXPECT_DOUBLE_EQ(session.move("G90\nM83\nG1 X9 E.5").delta(E), 0.5);
}

TEST(MarlinFactors, AreWholePercents) {
  Session session = marlin();
  session.read("M83\nG1 X1 Y1 Z1 F6000\nM220 S50.9\nM221 S90.5");
  EXPECT_DOUBLE_EQ(session.state().speed_factor, 0.5);
  const Segment segment = session.move("G1 X2 E1");
  EXPECT_DOUBLE_EQ(segment.feed_mm_s, 50.0);
  EXPECT_DOUBLE_EQ(segment.delta(E), 0.9);
  EXPECT_DOUBLE_EQ(session.move("G1 E-1").delta(E), -0.9) << "flow applies to E alone too";
  EXPECT_THAT(session.read("M220").warnings, IsEmpty());
  EXPECT_DOUBLE_EQ(session.state().speed_factor, 0.5) << "a report";
}

TEST(MarlinFactors, AreKeptByBAndTakenBackByR) {
  Session session = marlin();
  session.read("M220 S80\nM220 B\nM220 S120");
  EXPECT_DOUBLE_EQ(session.state().speed_factor, 1.2);
  session.read("M220 R");
  EXPECT_DOUBLE_EQ(session.state().speed_factor, 0.8);
  session.read("M220 B S150");
  EXPECT_DOUBLE_EQ(session.state().speed_factor, 1.5);
  EXPECT_DOUBLE_EQ(session.state().kept_speed_factor, 0.8);
}

TEST(MarlinVolumes, AreTurnedIntoFilament) {
  Session session = marlin();
  session.read("M83\nG1 X1 Y1 Z1\nM200 D2");
  EXPECT_TRUE(session.state().volumetric);
  EXPECT_NEAR(session.move("G1 X2 E3").delta(E), 3.0 / std::numbers::pi, 1e-12);
  session.read("M200 S0");
  EXPECT_DOUBLE_EQ(session.move("G1 X3 E3").delta(E), 3.0);
  session.read("M200 S1");
  EXPECT_NEAR(session.move("G1 X4 E3").delta(E), 3.0 / std::numbers::pi, 1e-12) << "2 mm still";
  session.read("M200 D0");
  EXPECT_DOUBLE_EQ(session.move("G1 X5 E3").delta(E), 3.0);
  session.read("M200 D1.75 S0");
  EXPECT_FALSE(session.state().volumetric);
}

TEST(MarlinVolumes, KeepTheReadingOfAbsoluteE) {
  Session session = marlin();
  session.read("G1 X1 Y1 Z1 E10\nM200 D2\nM221 S50");
  EXPECT_NEAR(session.move("G1 X2 E13").delta(E), 1.5 / std::numbers::pi, 1e-12);
}

TEST(MarlinVolumes, AreCubicInchesInInches) {
  Session session = marlin();
  session.read("M83\nG1 X1 Y1 Z1\nM200 D2\nG20");
  EXPECT_NEAR(session.move("G1 X1 E.001").delta(E), 0.001 * 25.4 * 25.4 * 25.4 / std::numbers::pi,
              1e-12);
  EXPECT_NEAR(session.move("M200 S0\nG1 X2 E.001").delta(E), 0.0254, 1e-12);
}

TEST(MarlinRetraction, IsUnknownToMostMarlins) {
  Session session = marlin();
  EXPECT_EQ(session.read("G10").kind, EventKind::passive);
  EXPECT_FALSE(session.state().retraction.retracted);
}

// Fuzzing found this case.
TEST(MarlinRetraction, WithoutASpeedGoesAsFastAsTheMoveBefore) {
  Session session = retracting();
  session.read("G1 X1 Y1 Z1 E10 F1200\nM220 S200\nM207 S2 F0");
  EXPECT_DOUBLE_EQ(session.move("G10").feed_mm_s, 20.0);
}

TEST(MarlinRetraction, IgnoresFlowAndSpeedFactorsAndKeepsTheReading) {
  Session session = retracting();
  session.read("G1 X1 Y1 Z1 E10\nM221 S50\nM220 S200\nM207 S2 F1800\nM208 S0.5 F600");
  const Segment back = session.move("G10");
  EXPECT_DOUBLE_EQ(back.delta(E), -2.0);
  EXPECT_DOUBLE_EQ(back.feed_mm_s, 30.0);
  EXPECT_EQ(session.read("G10").kind, EventKind::barrier) << "once only";
  const Segment on = session.move("G11");
  EXPECT_DOUBLE_EQ(on.delta(E), 2.5);
  EXPECT_DOUBLE_EQ(on.feed_mm_s, 10.0);
  EXPECT_DOUBLE_EQ(session.move("G1 X2 E11").delta(E), 0.5);
}

TEST(MarlinRetraction, HopsAfterItAndComesDownBeforeTheNext) {
  Session session = retracting(0.4);
  session.read("G1 X1 Y1 Z1 E10");
  const Event up = session.read("G10");
  ASSERT_THAT(up.segments, SizeIs(2));
  EXPECT_DOUBLE_EQ(up.segments[0].delta(E), -3.0);
  EXPECT_DOUBLE_EQ(up.segments[1].delta(Z), 0.4);
  EXPECT_DOUBLE_EQ(session.state().retraction.hop_mm, 0.4);
  EXPECT_DOUBLE_EQ(session.move("G1 X2 Z1").end_mm[Z], 1.4) << "Z reads as before";
  const Event down = session.read("G11");
  ASSERT_THAT(down.segments, SizeIs(2));
  EXPECT_DOUBLE_EQ(down.segments[0].delta(Z), -0.4);
  EXPECT_DOUBLE_EQ(down.segments[1].delta(E), 3.0);
}

TEST(MarlinRetraction, OfM209TakesOverShortMovesOfFilament) {
  Session session = retracting();
  session.read("G1 X1 Y1 Z1 E10\nM209 S1");
  const Segment back = session.move("G1 E8 F1200");
  EXPECT_DOUBLE_EQ(back.delta(E), -3.0) << "M207's length, not the file's";
  EXPECT_DOUBLE_EQ(back.feed_mm_s, 45.0);
  EXPECT_EQ(session.move("G1 E10").delta(E), 3.0);
  EXPECT_DOUBLE_EQ(session.move("G1 X2 E11").delta(E), 1.0);
  EXPECT_DOUBLE_EQ(session.move("G1 E-20").delta(E), -31.0) << "too long for one";
  session.read("M209 S0");
  EXPECT_DOUBLE_EQ(session.move("G1 E-21").delta(E), -1.0);
}

TEST(MarlinOrigin, OfABareG92Stays) {
  Session session = marlin();
  session.read("G1 X10 Y10 Z1 E5\nG92");
  EXPECT_DOUBLE_EQ(session.move("G1 X11").delta(X), 1.0);
  session.read("G92 E0");
  EXPECT_DOUBLE_EQ(session.move("G1 X12 E1").delta(E), 1.0);
}

}  // namespace
}  // namespace unflex::gcode
