// RepRapFirmware's limits, modes of E, factors, volumes and retraction.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include "interpreting.hpp"

namespace unflex::gcode {
namespace {

using ::testing::IsEmpty;
using ::testing::SizeIs;

Session rrf() { return Session(default_options(Firmware::rrf)); }

TEST(RrfLimits, OfSpeedAreInMillimetresPerMinute) {
  Session session = rrf();
  Event event = session.read("M203 X18000 Y12000 Z600 E3600 I30");
  EXPECT_EQ(event.kind, EventKind::limits);
  EXPECT_EQ(event.limits->axis_max_velocity_mm_s, (AxisValues{300.0, 200.0, 10.0, 60.0}));
  EXPECT_EQ(event.limits->min_movement_velocity_mm_s, 0.5);
  event = session.read("M203 S1 X300 I0");
  EXPECT_EQ(event.limits->axis_max_velocity_mm_s[X], 300.0);
  EXPECT_EQ(event.limits->min_movement_velocity_mm_s, 0.01) << "AbsoluteMinFeedrate";
  EXPECT_DOUBLE_EQ(*session.read("M203 E3600:1800").limits->axis_max_velocity_mm_s[E], 60.0);
}

TEST(RrfLimits, OfAccelerationTellApartPrintAndTravel) {
  Session session = rrf();
  Event event = session.read("M201 X1250 Y1000 E5000:3000");
  EXPECT_EQ(event.limits->axis_max_accel_mm_s2, (AxisValues{1250.0, 1000.0, std::nullopt, 5000.0}));
  event = session.read("M204 P800 T1500");
  EXPECT_EQ(event.limits->print_accel_mm_s2, 800.0);
  EXPECT_EQ(event.limits->travel_accel_mm_s2, 1500.0);
  EXPECT_EQ(event.limits->max_accel_mm_s2, std::nullopt);
  event = session.read("M204 S900");
  EXPECT_EQ(event.limits->print_accel_mm_s2, 900.0);
  EXPECT_EQ(event.limits->travel_accel_mm_s2, 900.0);
  EXPECT_EQ(session.read("M204 P0").limits->print_accel_mm_s2, 0.1) << "MinimumAcceleration";
  session.read("G20");
  EXPECT_EQ(session.read("M204 P800").limits->print_accel_mm_s2, 800.0) << "never in inches";
}

TEST(RrfLimits, OfJerkAreInMillimetresPerMinuteOrSecond) {
  Session session = rrf();
  Event event = session.read("M566 X600 Y480 Z30 E300:300 P1");
  EXPECT_EQ(event.kind, EventKind::limits);
  EXPECT_EQ(event.limits->axis_jerk_mm_s, (AxisValues{10.0, 8.0, 0.5, 5.0}));
  EXPECT_EQ(event.limits->jerk_policy, 1);
  event = session.read("M205 X10 Y8 P1");
  EXPECT_EQ(event.limits->axis_jerk_mm_s, (AxisValues{10.0, 8.0, std::nullopt, std::nullopt}));
  EXPECT_EQ(event.limits->jerk_policy, std::nullopt) << "only M566 has a policy";
  EXPECT_EQ(session.read("M566 X1").limits->axis_jerk_mm_s[X], 0.1) << "MinimumJerk";
  EXPECT_EQ(session.read("M566 P0").limits->jerk_policy, 0);
}

TEST(RrfLimits, ThatAreInvalidChangeNothing) {
  Session session = rrf();
  for (const char* line : {"M201 X-1", "M203 Y-5", "M204 P-1", "M204 T", "M566 X-3", "M220 S0",
                           "M221 S0.5", "M207 Z-1"}) {
    const Event event = session.read(line);
    EXPECT_EQ(event.kind, EventKind::passive) << line;
    EXPECT_THAT(event.warnings, SizeIs(1)) << line;
  }
}

// GCodes.cpp, LoadExtrusionAndFeedrateFromGCode: latestVirtualExtruderPosition.
TEST(RrfExtrusionMode, RelativeLengthsAreNoPartOfTheReading) {
  Session session = rrf();
  session.read("G1 X1 Y1 Z1 E10\nM83");
  EXPECT_DOUBLE_EQ(session.move("G1 X2 E2").delta(E), 2.0);
  EXPECT_NEAR(session.read("G2 X4 Y1 I1 E2").segments.back().end_mm[E], 14.0, 1e-12);
  EXPECT_NEAR(session.move("M82\nG1 X5 E11").delta(E), 1.0, 1e-12);
}

TEST(RrfExtrusionMode, HasNothingToDoWithG90AndG91) {
  Session session = rrf();
  session.read("G1 X1 Y1 Z1 E10");
  EXPECT_DOUBLE_EQ(session.move("G91\nG1 X1 E11").delta(E), 1.0);
  EXPECT_DOUBLE_EQ(session.move("M83\nG90\nG1 X5 E2").delta(E), 2.0);
  EXPECT_FALSE(session.state().e_is_absolute());
  EXPECT_DOUBLE_EQ(session.move("G91\nM82\nG1 X1 E14").delta(E), 3.0);
  EXPECT_TRUE(session.state().e_is_absolute());
}

// GCodes.cpp, LoadExtrusionAndFeedrateFromGCode: isPrintingMove.
TEST(RrfFactors, LeaveMovesOfFilamentAloneAsTheyAre) {
  Session session = rrf();
  session.read("M83\nG1 X1 Y1 Z1 F6000\nM220 S50.5\nM221 S90.5");
  const Segment printing = session.move("G1 X2 E1");
  EXPECT_DOUBLE_EQ(printing.feed_mm_s, 50.5);
  EXPECT_DOUBLE_EQ(printing.delta(E), 0.905);
  const Segment retracting = session.move("G1 E-1 F1800");
  EXPECT_DOUBLE_EQ(retracting.feed_mm_s, 30.0);
  EXPECT_NEAR(retracting.delta(E), -1.0, 1e-12);
  const Segment wiping = session.move("G1 X1 E-1");
  EXPECT_NEAR(wiping.delta(E), -0.905, 1e-12);
  EXPECT_DOUBLE_EQ(session.state().flow_factor, 0.905);
  EXPECT_DOUBLE_EQ(session.state().speed_factor, 0.505);
}

TEST(RrfFactors, KeepTheReadingOfAbsoluteE) {
  Session session = rrf();
  session.read("G1 X1 Y1 Z1 E10\nM221 S50\nG1 E8\nG1 E10");
  EXPECT_NEAR(session.move("G1 X2 E12").delta(E), 1.0, 1e-12);
  EXPECT_NEAR(session.state().position_mm[E], 11.0, 1e-12);
}

TEST(RrfFactors, BelongToAnExtruder) {
  Session session = rrf();
  session.read("T0\nM83\nM221 D1 S50\nG1 X1 Y1 Z1");
  EXPECT_DOUBLE_EQ(session.move("G1 X2 E1").delta(E), 1.0);
  session.read("M221 D0 S80\nM221 D2147483648 S10");
  EXPECT_DOUBLE_EQ(session.move("G1 X3 E1").delta(E), 0.8);
  session.read("T1\nG1 X1 Y1 Z1");
  EXPECT_DOUBLE_EQ(session.move("G1 X2 E1").delta(E), 0.5);
}

TEST(RrfVolumes, AreTurnedIntoFilament) {
  Session session = rrf();
  session.read("M83\nG1 X1 Y1 Z1\nM200 D2:2");
  EXPECT_NEAR(session.move("G1 X2 E3").delta(E), 3.0 / std::numbers::pi, 1e-12);
  session.read("M200 S0");
  EXPECT_DOUBLE_EQ(session.move("G1 X3 E3").delta(E), 3.0);
  session.read("M200 S1");
  EXPECT_NEAR(session.move("G1 X4 E3").delta(E), 3.0 / std::numbers::pi, 1e-12);
  session.read("M200 D0");
  EXPECT_DOUBLE_EQ(session.move("G1 X5 E3").delta(E), 3.0);
}

TEST(RrfVolumes, AreNeverCubicInches) {
  Session session = rrf();
  session.read("M83\nG1 X1 Y1 Z1\nM200 D2\nG20");
  EXPECT_NEAR(session.move("G1 X1 E1").delta(E), 25.4 / std::numbers::pi, 1e-12);
}

TEST(RrfRetraction, HasTheFirmwaresDefaults) {
  Session session = rrf();
  session.read("G1 X1 Y1 Z1 E10\nM220 S50\nM221 S50");
  const Segment back = session.move("G10");
  EXPECT_DOUBLE_EQ(back.delta(E), -2.0);
  EXPECT_DOUBLE_EQ(back.feed_mm_s, 1000.0 / 60.0);
  EXPECT_DOUBLE_EQ(session.move("G11").delta(E), 2.0);
  EXPECT_NEAR(session.move("G1 X2 E11").delta(E), 0.5, 1e-12) << "E reads as before";
}

TEST(RrfRetraction, TakesNewSettings) {
  Session session = rrf();
  session.read("G1 X1 Y1 Z1 E10\nM207 S1.5 R-0.1 F3600 T1800 Z0.3");
  const Event back = session.read("G10");
  ASSERT_THAT(back.segments, SizeIs(2));
  EXPECT_DOUBLE_EQ(back.segments[0].delta(E), -1.5);
  EXPECT_DOUBLE_EQ(back.segments[0].feed_mm_s, 60.0);
  EXPECT_DOUBLE_EQ(back.segments[1].delta(Z), 0.3);
  EXPECT_DOUBLE_EQ(session.move("G1 X2 Z1").end_mm[Z], 1.3);
  const Event on = session.read("G11");
  ASSERT_THAT(on.segments, SizeIs(2));
  EXPECT_DOUBLE_EQ(on.segments[0].delta(Z), -0.3);
  EXPECT_DOUBLE_EQ(on.segments[1].delta(E), 1.4);
  EXPECT_DOUBLE_EQ(on.segments[1].feed_mm_s, 30.0);
  session.read("M207 F30");
  EXPECT_DOUBLE_EQ(session.read("G10").segments[0].feed_mm_s, 1.0) << "MinRetractSpeed";
}

TEST(RrfRetraction, IsNotWhatG10ForAToolMeans) {
  Session session = rrf();
  session.read("G1 X1 Y1 Z1 E10");
  EXPECT_EQ(session.read("G10 P0 S210 R150").kind, EventKind::passive);
  EXPECT_FALSE(session.state().retraction.retracted);
  EXPECT_EQ(session.read("M103").kind, EventKind::move) << "Simplify3D's retraction";
  EXPECT_EQ(session.read("M101").kind, EventKind::move);
}

TEST(RrfStack, BringsTheModesBack) {
  Session session = rrf();
  session.read("G1 X1 Y1 Z1 F3000\nM83\nM200 D2\nM120");
  EXPECT_FALSE(session.state().volumetric) << "off in a new level";
  session.read("G91\nM82\nG20\nG1 X1 F60\nG93\nM121");
  EXPECT_TRUE(session.state().absolute_xyz);
  EXPECT_FALSE(session.state().absolute_e);
  EXPECT_EQ(session.state().unit_mm, 1.0);
  EXPECT_DOUBLE_EQ(session.state().feed_mm_s, 50.0);
  EXPECT_FALSE(session.state().inverse_time);
  EXPECT_TRUE(session.state().volumetric);
  EXPECT_THAT(session.read("M121").warnings, IsEmpty());
}

TEST(RrfOrigin, OfABareG92Stays) {
  Session session = rrf();
  session.read("G1 X10 Y10 Z1 E5\nG92");
  EXPECT_DOUBLE_EQ(session.move("G1 X11").delta(X), 1.0);
  EXPECT_EQ(session.read("G92 E0").kind, EventKind::passive);
  EXPECT_DOUBLE_EQ(session.move("G1 X12 E1").delta(E), 1.0);
}

}  // namespace
}  // namespace unflex::gcode
