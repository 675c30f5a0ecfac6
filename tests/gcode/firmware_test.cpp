// Commands with an effect on the planner or of their own: limits, dwells, firmware retraction,
// pressure advance.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "interpreting.hpp"

namespace unflex::gcode {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

TEST(Limits, ComeFromM204) {
  Session session;
  Event event = session.read("M204 S800");
  EXPECT_EQ(event.kind, EventKind::limits);
  EXPECT_EQ(event.limits->max_accel_mm_s2, 800.0);
  EXPECT_EQ(event.limits->max_velocity_mm_s, std::nullopt);
  EXPECT_EQ(session.read("M204 P900 T1200").limits->max_accel_mm_s2, 900.0);
  EXPECT_EQ(session.read("M204 P1500 T1200 R300").limits->max_accel_mm_s2, 1200.0);
  EXPECT_EQ(session.read("M204 P1500 T1200 S2000").limits->max_accel_mm_s2, 2000.0);
}

TEST(Limits, OfM204WithOneOfPAndTAreRefused) {
  Session session;
  for (const char* line : {"M204 P800", "M204 T800", "M204", "M204 R500"}) {
    const Event event = session.read(line);
    EXPECT_EQ(event.kind, EventKind::passive) << line;
    EXPECT_THAT(event.warnings, IsEmpty()) << line;
  }
  for (const char* line : {"M204 S0", "M204 S-1", "M204 S", "M204 P0 T100", "M204 P100 T"}) {
    const Event event = session.read(line);
    EXPECT_EQ(event.kind, EventKind::passive) << line;
    EXPECT_THAT(event.warnings, SizeIs(1)) << line;
  }
}

TEST(Limits, ComeFromSetVelocityLimit) {
  Session session;
  const Event event = session.read(
      "SET_VELOCITY_LIMIT VELOCITY=300 ACCEL=1e5 SQUARE_CORNER_VELOCITY=0 "
      "minimum_cruise_ratio=.25");
  EXPECT_EQ(event.kind, EventKind::limits);
  EXPECT_EQ(event.limits->max_velocity_mm_s, 300.0);
  EXPECT_EQ(event.limits->max_accel_mm_s2, 1e5);
  EXPECT_EQ(event.limits->square_corner_velocity_mm_s, 0.0);
  EXPECT_EQ(event.limits->minimum_cruise_ratio, 0.25);
  const Event one = session.read("SET_VELOCITY_LIMIT ACCEL=\"3000\" ACCEL_TO_DECEL=1500");
  EXPECT_EQ(one.kind, EventKind::limits);
  EXPECT_EQ(one.limits->max_accel_mm_s2, 3000.0);
  EXPECT_EQ(one.limits->max_velocity_mm_s, std::nullopt);
  EXPECT_EQ(one.limits->minimum_cruise_ratio, std::nullopt);
  EXPECT_EQ(one.limits->accel_to_decel_mm_s2, 1500.0);
  EXPECT_TRUE(one.may_set_limits);
  const Event both =
      session.read("SET_VELOCITY_LIMIT MINIMUM_CRUISE_RATIO=0.4 ACCEL_TO_DECEL=1500");
  EXPECT_EQ(both.limits->minimum_cruise_ratio, 0.4);
  EXPECT_FALSE(both.may_set_limits);
  const Event none = session.read("SET_VELOCITY_LIMIT ACCEL=3000 ACCEL_TO_DECEL=0");
  EXPECT_EQ(none.limits->max_accel_mm_s2, 3000.0);
  EXPECT_EQ(none.limits->accel_to_decel_mm_s2, std::nullopt);
}

TEST(Limits, ThatAreInvalidChangeNothing) {
  Session session;
  for (const char* line :
       {"VELOCITY=0", "ACCEL=-5", "ACCEL=fast", "ACCEL=", "ACCEL=1e999", "ACCEL=1e", "ACCEL=e5",
        "ACCEL=inf", "SQUARE_CORNER_VELOCITY=-1", "MINIMUM_CRUISE_RATIO=1",
        "MINIMUM_CRUISE_RATIO=-.1", "ACCEL=100 VELOCITY=0"}) {
    const Event event = session.read(std::string("SET_VELOCITY_LIMIT ") + line);
    EXPECT_EQ(event.kind, EventKind::passive) << line;
    EXPECT_THAT(event.warnings, SizeIs(1)) << line;
    EXPECT_EQ(event.limits->max_accel_mm_s2, std::nullopt) << line;
  }
  EXPECT_EQ(session.read("SET_VELOCITY_LIMIT").kind, EventKind::passive);
}

TEST(Dwell, LastsPMilliseconds) {
  Session session;
  Event event = session.read("G4 P250");
  EXPECT_EQ(event.kind, EventKind::barrier);
  EXPECT_FALSE(event.position_lost);
  EXPECT_DOUBLE_EQ(event.dwell_s, 0.25);
  event = session.read("G4 S10");
  EXPECT_EQ(event.kind, EventKind::barrier);
  EXPECT_EQ(event.dwell_s, 0.0) << "Klipper reads P alone";
  EXPECT_EQ(session.read("G4").dwell_s, 0.0);
  for (const char* wrong : {"G4 P-5", "G4 P"}) {
    event = session.read(wrong);
    EXPECT_EQ(event.kind, EventKind::barrier);
    EXPECT_EQ(event.dwell_s, 0.0);
    EXPECT_THAT(event.warnings, SizeIs(1)) << wrong;
  }
}

InterpreterOptions retracting() {
  InterpreterOptions options;
  options.retract_length_mm = 0.8;
  options.retract_speed_mm_s = 35.0;
  options.unretract_extra_length_mm = 0.05;
  options.unretract_speed_mm_s = 20.0;
  return options;
}

TEST(FirmwareRetraction, MovesFilamentAndKeepsItsReading) {
  Session session(retracting());
  session.read("G1 X1 Y1 Z1 E10 F6000");
  const Segment retract = session.move("G10 ; retract");
  EXPECT_NEAR(retract.delta(E), -0.8, 1e-12);
  EXPECT_EQ(retract.length_mm(), 0.0);
  EXPECT_DOUBLE_EQ(retract.feed_mm_s, 35.0);
  EXPECT_TRUE(retract.start_known);
  const Segment unretract = session.move("G11");
  EXPECT_NEAR(unretract.delta(E), 0.85, 1e-12);
  EXPECT_DOUBLE_EQ(unretract.feed_mm_s, 20.0);
  const Segment next = session.move("G1 X2 E11");
  EXPECT_NEAR(next.delta(E), 1.0, 1e-12);
  EXPECT_DOUBLE_EQ(next.feed_mm_s, 100.0) << "the modal speed stays";
}

// G10 or G11 may seem to have nothing to do, but an earlier macro may have changed that. So the
// machine counts as stopped.
TEST(FirmwareRetraction, HappensOnceAndStopsAnyhow) {
  Session session(retracting());
  EXPECT_EQ(session.read("G11").kind, EventKind::barrier) << "nothing to undo";
  EXPECT_EQ(session.read("G10").kind, EventKind::move);
  EXPECT_TRUE(session.state().retraction.retracted);
  EXPECT_EQ(session.read("G10").kind, EventKind::barrier);
  EXPECT_EQ(session.read("G11").kind, EventKind::move);
  EXPECT_EQ(session.read("G11").kind, EventKind::barrier);
}

TEST(FirmwareRetraction, FollowsFlowAndSpeedFactors) {
  Session session(retracting());
  const Segment segment = session.move("M221 S50\nM220 S200\nG91\nG10");
  EXPECT_NEAR(segment.delta(E), -0.4, 1e-12);
  EXPECT_DOUBLE_EQ(segment.feed_mm_s, 70.0);
}

TEST(FirmwareRetraction, OfUnknownLengthStopsTheMachine) {
  Session session;
  const Event event = session.read("G1 X1 Y1 Z1\nG10");
  EXPECT_EQ(event.kind, EventKind::barrier);
  EXPECT_FALSE(event.position_lost);
  EXPECT_EQ(event.dwell_s, 0.0);
  EXPECT_EQ(session.read("G11").kind, EventKind::barrier);
}

TEST(FirmwareRetraction, IsWrittenInKlippersDecimals) {
  InterpreterOptions options = retracting();
  options.retract_length_mm = 0.1234567;
  options.retract_speed_mm_s = 35.51;
  Session session(options);
  const Segment segment = session.move("G10");
  EXPECT_DOUBLE_EQ(segment.delta(E), -0.12346);
  EXPECT_DOUBLE_EQ(segment.feed_mm_s, 2130.0 / 60.0);
}

TEST(FirmwareRetraction, IsWhatG10MeansWithWordsToo) {
  Session session(retracting());
  EXPECT_EQ(session.read("G10 S210 P0").kind, EventKind::move);
  EXPECT_TRUE(session.state().retraction.retracted);
}

TEST(FirmwareRetraction, IsIgnoredWhereItIsNotConfigured) {
  InterpreterOptions options = retracting();
  options.firmware_retraction = false;
  Session session(options);
  std::size_t warnings = 0;
  for (const char* line : {"G10", "G11", "G10 S210 P0"}) {
    const Event event = session.read(line);
    EXPECT_EQ(event.kind, EventKind::passive) << line;
    warnings += event.warnings.size();
  }
  EXPECT_EQ(warnings, 1U) << "it is said once";
  EXPECT_EQ(session.state().position_mm[E], 0.0);
}

TEST(FirmwareRetraction, TakesNewSettings) {
  Session session(retracting());
  Event event = session.read("G10\nSET_RETRACTION RETRACT_LENGTH=1.5 RETRACT_SPEED=40");
  EXPECT_EQ(event.kind, EventKind::passive);
  const Segment segment = session.move("G10");
  EXPECT_NEAR(segment.delta(E), -1.5, 1e-12);
  EXPECT_DOUBLE_EQ(segment.feed_mm_s, 40.0);
  session.read("SET_RETRACTION UNRETRACT_EXTRA_LENGTH=.1 UNRETRACT_SPEED=5\nG10");
  EXPECT_NEAR(session.move("G11").delta(E), 1.6, 1e-12);
  for (const char* wrong : {"SET_RETRACTION RETRACT_LENGTH=-1", "SET_RETRACTION RETRACT_SPEED=0",
                            "SET_RETRACTION UNRETRACT_SPEED=x RETRACT_LENGTH=9"}) {
    EXPECT_THAT(session.read(wrong).warnings, SizeIs(1)) << wrong;
  }
  EXPECT_NEAR(session.move("G10").delta(E), -1.5, 1e-12);
}

// unflex sets it again behind macros, so the next value of the file is no stop.
TEST(PressureAdvance, WhichRunsHaveOnIsOnBehindMacros) {
  InterpreterOptions options = default_options(Firmware::klipper);
  options.advance_of_runs = RunAdvance::on;
  Session none(options);
  EXPECT_EQ(none.read("SET_PRESSURE_ADVANCE ADVANCE=0.04").kind, EventKind::barrier);
  EXPECT_EQ(none.read("SOME_MACRO").kind, EventKind::barrier);
  EXPECT_EQ(none.read("SET_PRESSURE_ADVANCE ADVANCE=0.05").kind, EventKind::passive);
  options.begins_advanced = true;
  Session known(options);
  EXPECT_EQ(known.read("SET_PRESSURE_ADVANCE ADVANCE=0.04").kind, EventKind::passive);
}

TEST(PressureAdvance, WhichRunsHaveOffEndsThem) {
  for (const auto& [firmware, line] :
       {std::pair{Firmware::klipper, "SET_PRESSURE_ADVANCE ADVANCE=0.04"},
        std::pair{Firmware::marlin, "M900 K0.04"}, std::pair{Firmware::rrf, "M572 D0 S0.04"}}) {
    InterpreterOptions options = default_options(firmware);
    options.advance_of_runs = RunAdvance::off;
    Session session(options);
    for (int times = 0; times < 2; ++times) {
      EXPECT_EQ(session.read(line).kind, EventKind::barrier) << line;
    }
  }
}

TEST(PressureAdvance, KeepsWhatKlipperIsToldOfItsExtruder) {
  Session session;
  session.read("SET_PRESSURE_ADVANCE EXTRUDER=extruder1 ADVANCE=0.04 SMOOTH_TIME=0.02");
  EXPECT_EQ(session.state().pressure_advance.extruder, "extruder1");
  EXPECT_EQ(session.state().pressure_advance.smooth_s, 0.02);
  session.read("SET_PRESSURE_ADVANCE ADVANCE=0.05");
  EXPECT_EQ(session.state().pressure_advance.extruder, "");
  EXPECT_FALSE(session.state().pressure_advance.smooth_s);
}

// A changed smoothing time makes Klipper stop, and so does switching the advance on or off.
TEST(PressureAdvance, StopsOnlyWhenItIsSwitchedOnOrOff) {
  Session session;
  EXPECT_EQ(session.read("SET_PRESSURE_ADVANCE ADVANCE=0.04").kind, EventKind::barrier);
  EXPECT_EQ(session.read("SET_PRESSURE_ADVANCE ADVANCE=0.05").kind, EventKind::passive);
  EXPECT_EQ(session.read("SET_PRESSURE_ADVANCE").kind, EventKind::passive);
  EXPECT_EQ(session.read("SET_PRESSURE_ADVANCE ADVANCE=0").kind, EventKind::barrier);
  EXPECT_EQ(session.read("SET_PRESSURE_ADVANCE ADVANCE=0").kind, EventKind::passive);
  EXPECT_EQ(session.read("SET_PRESSURE_ADVANCE SMOOTH_TIME=0.02").kind, EventKind::barrier);
  EXPECT_EQ(session.read("SET_PRESSURE_ADVANCE EXTRUDER=extruder1 ADVANCE=0").kind,
            EventKind::barrier);
  EXPECT_FALSE(session.read("SET_PRESSURE_ADVANCE ADVANCE=0.05").position_lost);
  session.read("MY_MACRO");
  EXPECT_EQ(session.state().pressure_advance.advance_s, 0.05) << "the best guess";
  EXPECT_EQ(session.read("SET_PRESSURE_ADVANCE ADVANCE=0.05").kind, EventKind::barrier);
}

TEST(InputShaper, IsKeptForItsRestoration) {
  InterpreterOptions options;
  options.shaper_freq_hz.x = 45.0;
  Session session(options);
  EXPECT_EQ(session.state().shaper.settings, ShaperSettings{}) << "the configuration's";
  session.read("SET_INPUT_SHAPER SHAPER_FREQ_Y=38 SHAPER_TYPE=ei DAMPING_RATIO_X=0.08");
  session.read("SET_INPUT_SHAPER SHAPER_TYPE_Y=mzv");
  EXPECT_EQ(session.state().shaper.freq_hz.x, 45.0);
  EXPECT_EQ(session.state().shaper.freq_hz.y, 38.0);
  EXPECT_EQ(session.state().shaper.settings.type.x, "ei");
  EXPECT_EQ(session.state().shaper.settings.type.y, "mzv");
  EXPECT_EQ(session.state().shaper.settings.damping_ratio.x, 0.08);
  EXPECT_EQ(session.state().shaper.settings.damping_ratio.y, std::nullopt);
}

}  // namespace
}  // namespace unflex::gcode
