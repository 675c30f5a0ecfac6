// Which commands stop a machine with Marlin, which lose its position, and which do neither.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <regex>

#include "interpreting.hpp"

namespace unflex::gcode {
namespace {

using ::testing::IsEmpty;
using ::testing::SizeIs;

class MarlinCommand : public ::testing::TestWithParam<const char*> {
 protected:
  MarlinCommand() : session_(default_options(Firmware::marlin)) { session_.read("G1 X1 Y1 Z1"); }
  Session session_;
};

class MarlinPassive : public MarlinCommand {};
class MarlinStopping : public MarlinCommand {};
class MarlinLosing : public MarlinCommand {};
class MarlinDoubtful : public MarlinCommand {};

TEST_P(MarlinPassive, LetsTheMotionGoOn) {
  const Event event = session_.read(GetParam());
  EXPECT_EQ(event.kind, EventKind::passive);
  EXPECT_FALSE(event.position_lost);
  EXPECT_THAT(event.segments, IsEmpty());
  EXPECT_THAT(event.warnings, IsEmpty());
  EXPECT_TRUE(session_.move("G1 X2").start_known);
}

INSTANTIATE_TEST_SUITE_P(
    Commands, MarlinPassive,
    ::testing::Values("", "; comment", "N5", "M73 P10 R5", "M82", "M104 S210", "M105", "M106 S255",
                      "M107", "M110 N0", "M113 S2", "M114", "M115", "M117 G28 now", "M118 E1 text",
                      "M140 S60", "M141 S40", "M155 S2", "M201", "M203", "M204", "M205", "M207 S2",
                      "M211 S0", "M220 S90", "M221 S95", "M300 S440 P50", "M302 S0", "M412 S1",
                      "M569 S1 X", "M593 D0.1", "M862.3 P \"MK3S\"", "M900", "M906 X800",
                      "M907 E430", "M75", "M77", "M84 S30", "M18 S0", "G10", "G11", "G92", "G92 E0",
                      "G17", "G21", "G90", "G91", "G1 F0", "M851 Z-1.2", "M200 D0", "M202 X1000",
                      "M142 S36", "M567 P0 E1", "M708 A3", "M971 S11 C11 O0", "M991 S0 P1",
                      "M1002 gcode_claim_action : 0"));

TEST_P(MarlinStopping, FinishesAllMotionAndKeepsThePosition) {
  const Event event = session_.read(GetParam());
  EXPECT_EQ(event.kind, EventKind::barrier);
  EXPECT_FALSE(event.position_lost);
  EXPECT_THAT(event.warnings, IsEmpty());
  EXPECT_TRUE(session_.move("G1 X2").start_known);
}

INSTANTIATE_TEST_SUITE_P(Commands, MarlinStopping,
                         ::testing::Values("G4", "G4 P100", "M400", "M109 S210", "M190 S60",
                                           "M191 S40", "M17", "G60", "M3 S5", "M5", "M7", "G92 X0",
                                           "M593 F40", "M593 X F0", "M900 K0.05", "M900 T1 K0.04",
                                           "M303 E0 S210"));

TEST_P(MarlinLosing, LeavesTheMachineAnywhere) {
  const Event event = session_.read(GetParam());
  EXPECT_EQ(event.kind, EventKind::barrier);
  EXPECT_TRUE(event.position_lost);
  // A line of motion names the words that are to blame.
  const bool blames_words = std::regex_search(GetParam(), std::regex("^G[0-3] .*[ABCDPSUVW][0-9]"));
  EXPECT_EQ(event.warnings.size(), blames_words ? 1U : 0U);
  EXPECT_FALSE(session_.move("G1 X2").start_known);
}

INSTANTIATE_TEST_SUITE_P(Commands, MarlinLosing,
                         ::testing::Values("G28", "G28 X", "G29", "G80", "G27", "G12", "G5 X1 Y1",
                                           "G6", "G30", "G34", "G38.2 Z0", "G53", "G54", "G59.2",
                                           "G61", "G92.1", "M0", "M1", "M25", "M226 P2", "M48",
                                           "M500", "M217 Q", "M118 A1 action:pause", "G1 X5 S200",
                                           "M84", "M18 X", "M112", "M125", "M206 X1", "M410",
                                           "M420 S1", "M428", "M524", "M600", "M605 S1", "M701",
                                           "M810", "M999", "M1234", "M240", "M622 J1", "M620 S0A",
                                           "M970", "T0", "T1", "X5", "PRINT_START BED=60", "@pause",
                                           "G1 U5", "G1 X5 A1"));

TEST_P(MarlinDoubtful, PassesAsABarrierWithAWarning) {
  const Event event = session_.read(GetParam());
  EXPECT_EQ(event.kind, EventKind::barrier);
  EXPECT_TRUE(event.position_lost);
  EXPECT_THAT(event.warnings, SizeIs(1));
  EXPECT_FALSE(session_.move("G1 X2").start_known);
}

INSTANTIATE_TEST_SUITE_P(Lines, MarlinDoubtful,
                         ::testing::Values("g1 X5", "G1 x5", "G1 X5 (to Y7)", "N5 G1 X3*0", "G1 X",
                                           "?", "M501", "M502"));

TEST(MarlinTool, InUseKeepsThePosition) {
  Session session(default_options(Firmware::marlin));
  session.read("T0\nG1 X1 Y1 Z1");
  EXPECT_FALSE(session.read("T0").position_lost);
  EXPECT_TRUE(session.read("T1").position_lost);
}

TEST(MarlinTool, HasItsOwnPressureAdvance) {
  Session session(default_options(Firmware::marlin));
  session.read("T0\nM900 K0.05\nT1");
  EXPECT_EQ(session.read("M900 K0.05").kind, EventKind::barrier);
  EXPECT_EQ(session.read("M900 K0.05").kind, EventKind::passive);
  session.read("M900 T0 K0.04");
  EXPECT_EQ(session.read("M900 K0.05").kind, EventKind::barrier) << "of the other one, maybe";
}

TEST(MarlinFixedTimeMotion, IsWarnedOfWhereItGoesOn) {
  Session session(default_options(Firmware::marlin));
  session.read("G28\nG1 X1 Y1 Z1");
  const Event off = session.read("M493 S0");
  EXPECT_EQ(off.kind, EventKind::barrier);
  EXPECT_FALSE(off.position_lost);
  EXPECT_THAT(off.warnings, IsEmpty());
  EXPECT_EQ(session.read("M493 S1").warnings.size(), 1U);
  EXPECT_TRUE(session.move("G1 X2").start_known);
}

TEST(MarlinModes, AreSetWhateverStandsInParentheses) {
  Session session(default_options(Firmware::marlin));
  session.read("M83");
  EXPECT_THAT(session.read("G90 (absolute)").warnings, IsEmpty());
  EXPECT_TRUE(session.state().absolute_e);
}

TEST(MarlinModes, InLowerCaseLeaveTheRestAsItIs) {
  for (const char* line : {"g91", "m83", "m220 s50"}) {
    Session session(default_options(Firmware::marlin));
    EXPECT_THAT(session.read(line).warnings, SizeIs(1)) << line;
    session.read("G1 X1 Y1 Z1");
    EXPECT_FALSE(session.move("G1 X2").start_known) << line;
  }
}

// A cancelled object may have left Z anywhere.
TEST(MarlinObjects, AreFollowedByAMoveThatBringsZBack) {
  Session session(default_options(Firmware::marlin));
  session.read("G1 X1 Y1 Z0.3\nM486 S1\nG1 X2 Y2");
  EXPECT_TRUE(session.move("G1 X3").start_known);
  EXPECT_EQ(session.read("G1 Z0.3").kind, EventKind::border);
  EXPECT_EQ(session.read("G1 Z0.3").kind, EventKind::passive);
  session.read("M486 S0\nG1 X2 Y2");
  EXPECT_FALSE(session.move("G1 X3 Z0.3").start_known);
  EXPECT_TRUE(session.move("G1 X4 Z0.3").start_known);
}

TEST(MarlinTool, HasItsOwnFlow) {
  Session session(default_options(Firmware::marlin));
  session.read("T0\nM83\nM221 S50\nM221 T1 S200\nM221 T2147483648 S10\nG1 X1 Y1 Z1");
  EXPECT_DOUBLE_EQ(session.move("G1 X2 E1").delta(E), 0.5);
  session.read("T1\nG1 X1 Y1 Z1");
  EXPECT_DOUBLE_EQ(session.move("G1 X2 E1").delta(E), 2.0);
  session.read("T0\nG1 X1 Y1 Z1");
  EXPECT_DOUBLE_EQ(session.move("G1 X2 E1").delta(E), 0.5);
}

TEST(MarlinDwell, TakesSecondsBeforeMilliseconds) {
  Session session(default_options(Firmware::marlin));
  EXPECT_DOUBLE_EQ(session.read("G4 P250").dwell_s, 0.25);
  EXPECT_DOUBLE_EQ(session.read("G4 S2").dwell_s, 2.0);
  EXPECT_DOUBLE_EQ(session.read("G4 S1.5 P100").dwell_s, 1.5);
  EXPECT_DOUBLE_EQ(session.read("G4").dwell_s, 0.0);
  EXPECT_THAT(session.read("G4 P-5").warnings, SizeIs(1));
}

TEST(MarlinLinearAdvance, StopsOnlyForANewFactor) {
  Session session(default_options(Firmware::marlin));
  EXPECT_EQ(session.read("M900 K0.05").kind, EventKind::barrier);
  EXPECT_EQ(session.state().pressure_advance.advance_s, 0.05);
  EXPECT_EQ(session.read("M900 K0.05").kind, EventKind::passive);
  EXPECT_EQ(session.read("M900 K0").kind, EventKind::barrier);
  EXPECT_EQ(session.read("M900 K11").kind, EventKind::passive) << "out of range";
  session.read("T1");
  EXPECT_EQ(session.read("M900 K0").kind, EventKind::barrier) << "maybe another extruder";
}

TEST(MarlinShaper, IsKeptForItsRestoration) {
  InterpreterOptions options = default_options(Firmware::marlin);
  options.shaper_freq_hz.x = 40.0;
  options.shaper_freq_hz.y = 35.0;
  Session session(options);
  EXPECT_EQ(session.state().shaper.freq_hz.x, 40.0);
  EXPECT_EQ(session.state().shaper.settings.damping_ratio.x, std::nullopt);
  EXPECT_EQ(session.read("M593 X F50 D0.2").kind, EventKind::barrier);
  EXPECT_EQ(session.state().shaper.freq_hz.x, 50.0);
  EXPECT_EQ(session.state().shaper.freq_hz.y, 35.0);
  EXPECT_EQ(session.state().shaper.settings.damping_ratio.x, 0.2);
  EXPECT_EQ(session.state().shaper.settings.damping_ratio.y, std::nullopt);
  session.read("M593 F0");
  EXPECT_EQ(session.state().shaper.freq_hz.x, 0.0);
  EXPECT_EQ(session.state().shaper.freq_hz.y, 0.0);
  EXPECT_EQ(session.state().shaper.settings.damping_ratio.x, 0.2);
  session.read("M593 X Y F30");
  EXPECT_EQ(session.state().shaper.freq_hz.x, 30.0);
  EXPECT_EQ(session.state().shaper.freq_hz.y, 30.0);
  EXPECT_EQ(session.read("M593 D1.5").kind, EventKind::passive) << "out of range";
  EXPECT_EQ(session.state().shaper.settings.damping_ratio.x, 0.2);
}

TEST(MarlinSteps, AreRecordedAndSaidOnce) {
  Session session(default_options(Firmware::marlin));
  Event event = session.read("M92 X80 E95.5");
  EXPECT_EQ(event.kind, EventKind::barrier);
  EXPECT_THAT(event.warnings, SizeIs(1));
  EXPECT_EQ(session.state().steps_per_mm, (AxisValues{80.0, std::nullopt, std::nullopt, 95.5}));
  event = session.read("M92 E95.5");
  EXPECT_EQ(event.kind, EventKind::passive);
  EXPECT_THAT(event.warnings, IsEmpty());
}

TEST(MarlinSteps, OfTheConfigurationAreNotWorthAWord) {
  InterpreterOptions options = default_options(Firmware::marlin);
  options.steps_per_mm = {80.0, 80.0, 400.0, 415.2};
  Session session(options);
  EXPECT_THAT(session.read("M92 X80 Y80 Z400 E415.2").warnings, IsEmpty());
  EXPECT_THAT(session.read("M92 X81 E400").warnings, SizeIs(2));
}

TEST(MarlinInches, AreReadAndRemarkedUpon) {
  Session session(default_options(Firmware::marlin));
  EXPECT_THAT(session.read("G20").warnings, SizeIs(1));
  EXPECT_DOUBLE_EQ(session.move("G1 X1 F60").delta(X), 25.4);
  EXPECT_DOUBLE_EQ(session.state().feed_mm_s, 25.4);
}

}  // namespace
}  // namespace unflex::gcode
