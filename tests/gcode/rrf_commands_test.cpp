// Which commands stop a machine with RepRapFirmware, which lose its position, and which do neither.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <regex>

#include "interpreting.hpp"

namespace unflex::gcode {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class RrfCommand : public ::testing::TestWithParam<const char*> {
 protected:
  RrfCommand() : session_(default_options(Firmware::rrf)) { session_.read("T0\nG1 X1 Y1 Z1 E0"); }
  Session session_;
};

class RrfPassive : public RrfCommand {};
class RrfStopping : public RrfCommand {};
class RrfLosing : public RrfCommand {};
class RrfDoubtful : public RrfCommand {};

// GCodes2.cpp, HandleGcode and HandleMcode; GCodeQueue.cpp, ShouldQueueMCode.
TEST(RrfBuffer, IsAwaitedByMovesAndByWhatIsTiedToItsPlaceAmongThem) {
  Session session(default_options(Firmware::rrf));
  for (const char* line : {"G1 F3000", "G1 X1", "G0 Y1", "G2 X2 I1", "G10", "M106 S1", "M104 S200",
                           "M117 \"hello\"", "M42 P1 S1"}) {
    EXPECT_TRUE(session.read(line).waits_for_buffer) << line;
  }
  for (const char* line : {"", "; G1", "M201 X500", "M203 X600", "M204 P500", "M205 X5", "M566 X60",
                           "M220 S90", "M83", "G92 E0", "G91", "M73 P1"}) {
    EXPECT_FALSE(session.read(line).waits_for_buffer) << line;
  }
}

TEST(RrfAdvance, IsThatOfTheFirstExtruder) {
  Session session(default_options(Firmware::rrf));
  EXPECT_FALSE(session.state().pressure_advance.advance_s);
  session.read("M572 D0 S0.045");
  EXPECT_EQ(session.state().pressure_advance.advance_s, 0.045);
  session.read("M572 D1 S0.08");
  EXPECT_EQ(session.state().pressure_advance.advance_s, 0.045);
  session.read("M572 S0");
  EXPECT_EQ(session.state().pressure_advance.advance_s, 0.0);
}

TEST_P(RrfPassive, LetsTheMotionGoOn) {
  const Event event = session_.read(GetParam());
  EXPECT_EQ(event.kind, EventKind::passive);
  EXPECT_FALSE(event.position_lost);
  EXPECT_THAT(event.segments, IsEmpty());
  EXPECT_THAT(event.warnings, IsEmpty());
  EXPECT_TRUE(session_.move("G1 X2").start_known);
}

INSTANTIATE_TEST_SUITE_P(
    Commands, RrfPassive,
    ::testing::Values("", "; comment", ";TYPE:Perimeter", "M73 P10 R5", "M82", "M104 S210", "M105",
                      "M106 P0 S0.5", "M107", "M117 \"hello\"", "M118 P0 S\"text\"", "M140 S60",
                      "M141 S40", "M201", "M203", "M204", "M205", "M566", "M207 S2", "M220", "M221",
                      "M220 S90", "M221 S95", "M280 P0 S90", "M290 S0.05", "M291 P\"hi\" S1",
                      "M300 S440 P50", "M42 P1 S1", "M568 P0 S210", "M591 D0", "M593 H1",
                      "G10 P0 S210", "G10 R150 S200", "G31 P500", "G92", "G92 E0", "G17", "G20",
                      "G21", "G90", "G91", "G94", "M121", "M201.1 X100", "var x = 3",
                      "global y = {1+2}", "set var.x = 4", "echo \"G28\"",
                      "M104 S{global.temperature}", "M117 {state.status}", "M200",
                      "M106 S1 M104 S210", "G21 G90 M83", "M82 M83", "M202 X1000", "M862 P1",
                      "M971 S11 C11 O0", "M981 S1 P20000"));

TEST_P(RrfStopping, FinishesAllMotionAndKeepsThePosition) {
  const Event event = session_.read(GetParam());
  EXPECT_EQ(event.kind, EventKind::barrier);
  EXPECT_FALSE(event.position_lost);
  EXPECT_THAT(event.warnings, IsEmpty());
  EXPECT_TRUE(session_.move("G1 X2").start_known);
}

INSTANTIATE_TEST_SUITE_P(Commands, RrfStopping,
                         ::testing::Values("G4", "G4 P100", "M400", "M109 S210", "M109", "M116",
                                           "M190 S60", "M191 S40", "M17", "M84 S5", "G92 X0", "G18",
                                           "T0", "G11", "M572 D0 S0.05", "M593 P\"none\"",
                                           "M593 F40", "M593 L0.2", "M120", "G60 S1", "M302 P1",
                                           "M569 P0 S1", "M574 X1", "M150 R255", "M906 X800",
                                           "M913 X50", "M577 P1", "M190 S{global.bed}",
                                           "M104 S210 M400"));

TEST_P(RrfLosing, LeavesTheMachineAnywhere) {
  const Event event = session_.read(GetParam());
  EXPECT_EQ(event.kind, EventKind::barrier);
  EXPECT_TRUE(event.position_lost);
  // A line of motion names the words that are to blame.
  const bool blames_words = std::regex_search(GetParam(), std::regex("^G[0-3] .*[ABCDPSUVW][0-9]"));
  EXPECT_EQ(event.warnings.size(), blames_words ? 1U : 0U);
  EXPECT_FALSE(session_.move("G1 X2").start_known);
}

INSTANTIATE_TEST_SUITE_P(
    Commands, RrfLosing,
    ::testing::Values("G28", "G28 Z", "G29", "G30", "G32", "G38.2 Z0", "G53", "G54", "G59.1",
                      "G68 R5", "G69", "G1009", "G10 L2 P1 X5", "G10 P0 X5", "G10 L20 P1 X0", "M0",
                      "M1", "M2", "M18", "M84", "M84 X", "M24", "M25", "M98 P\"macro.g\"", "M112",
                      "M206 X1", "M226", "M291 P\"go?\" S2", "M375", "M401", "M402", "M451", "M561",
                      "M563 P0", "M579 X2", "M584 X0", "M585 X", "M596 P1", "M600", "M601", "M606",
                      "M665 L200", "M669 K0", "M701 S\"PLA\"", "M702", "M703", "M28 \"x\"",
                      "M900 K0.1", "M862.3 P\"MK3S\"", "M999", "M1234", "M106.1", "M558.1", "T1",
                      "T-1", "T{var.tool}", "G1 H1 X-300", "G1 R2 X0", "G1 U5",
                      "START_PRINT BED=60", "if true", "while iterations < 3", "abort", "else",
                      "G1 X{var.x}", "var before = move.axes[0].acceleration", "G1 X5 S1",
                      "G1 X5 P1"));

TEST_P(RrfDoubtful, PassesAsABarrierWithAWarning) {
  const Event event = session_.read(GetParam());
  EXPECT_EQ(event.kind, EventKind::barrier);
  EXPECT_TRUE(event.position_lost);
  EXPECT_THAT(event.warnings, SizeIs(1));
  EXPECT_FALSE(session_.move("G1 X2").start_known);
}

INSTANTIATE_TEST_SUITE_P(Lines, RrfDoubtful,
                         ::testing::Values("G1 X5 G1 Y5", "G1 X5 M106 S1", "M106 S1 G1 X5",
                                           "M106 S1 M82", "T0 M83", "G91 G1 X5", "G53 G1 X5",
                                           "G1 X5 X6", "G1 X5 E1:2", "N5 G1 X3*0", "G1 X", "?",
                                           "M501", "M502", "M220 S{global.speed}",
                                           "M204 P{global.accel}"));

TEST(RrfLines, OfSeveralModesSetThemAll) {
  Session session(default_options(Firmware::rrf));
  session.read("G20\nG91\nG21 G90 M83");
  EXPECT_EQ(session.state().unit_mm, 1.0);
  EXPECT_TRUE(session.state().absolute_xyz);
  EXPECT_FALSE(session.state().absolute_e);
}

TEST(RrfLines, OfSeveralCommandsThatMayChangeModesLeaveTheRestAsItIs) {
  for (const char* line : {"M106 S1 M82", "T0 M83", "G91 G1 X5", "G1 X5 M220 S50"}) {
    Session session(default_options(Firmware::rrf));
    EXPECT_THAT(
        session.read(line).warnings,
        ElementsAre("several commands in one line: what follows is passed through unchanged"))
        << line;
    session.read("G1 X1 Y1 Z1");
    EXPECT_FALSE(session.move("G1 X2").start_known) << line;
  }
}

TEST(RrfTool, IsNotKnownAfterAMacroOrACondition) {
  for (const char* line : {"M98 P\"purge.g\"", "if true\n  T1"}) {
    Session session(default_options(Firmware::rrf));
    session.read("T0\nM83\nM221 S50");
    session.read(line);
    session.read("G1 X1 Y1 Z1");
    EXPECT_TRUE(session.read("T0").position_lost) << line;
    EXPECT_EQ(session.state().flow_factor, 0.5) << line;
  }
}

TEST(RrfTool, InUseKeepsThePosition) {
  Session session(default_options(Firmware::rrf));
  session.read("T0\nG1 X1 Y1 Z1");
  EXPECT_FALSE(session.read("T0").position_lost);
  EXPECT_TRUE(session.read("T1").position_lost);
  session.read("G1 X1 Y1 Z1");
  EXPECT_FALSE(session.read("T1").position_lost);
}

TEST(RrfTool, IsSelectedByM109WhereThereIsNone) {
  Session session(default_options(Firmware::rrf));
  session.read("G1 X1 Y1 Z1");
  EXPECT_FALSE(session.read("M109").position_lost) << "no target, nothing selected";
  EXPECT_TRUE(session.read("M109 S200").position_lost);
  session.read("G1 X1 Y1 Z1");
  EXPECT_FALSE(session.read("M109 S210").position_lost);
  EXPECT_FALSE(session.read("T0").position_lost);
  session.read("T-1\nG1 X1 Y1 Z1");
  EXPECT_TRUE(session.read("M109 S210").position_lost) << "none in use again";
}

TEST(RrfObjects, AreLabelledByComments) {
  for (const char* line : {"; printing object cube id:0 copy 0", "; stop printing object cube",
                           ";MESH:cube.stl", "; process Process1", "M486 S0"}) {
    Session session(default_options(Firmware::rrf));
    session.read("G1 X1 Y1 Z1");
    EXPECT_EQ(session.read(line).kind, EventKind::border) << line;
    EXPECT_FALSE(session.move("G1 X2").start_known) << line;
  }
  for (const char* line : {"; processing", ";MESHES", "G1 X1 ; printing object",
                           " ; printing object", ";LAYER:3", ";HEIGHT:0.2"}) {
    Session session(default_options(Firmware::rrf));
    session.read("G1 X1 Y1 Z1");
    session.read(line);
    EXPECT_TRUE(session.move("G1 X2").start_known) << line;
  }
}

TEST(RrfInverseTime, MakesMovesUnreadableUntilG94) {
  Session session(default_options(Firmware::rrf));
  session.read("G1 X1 Y1 Z1\nG93");
  EXPECT_THAT(session.read("G1 X5 F2").warnings, SizeIs(1));
  EXPECT_FALSE(session.move("G94\nG1 X3 Y1 Z1 F3000").start_known);
  EXPECT_TRUE(session.move("G1 X2").start_known);
}

TEST(RrfDwell, TakesSecondsBeforeMilliseconds) {
  Session session(default_options(Firmware::rrf));
  EXPECT_DOUBLE_EQ(session.read("G4 P250").dwell_s, 0.25);
  EXPECT_DOUBLE_EQ(session.read("G4 S2").dwell_s, 2.0);
  EXPECT_DOUBLE_EQ(session.read("G4 P100 S1.5").dwell_s, 1.5);
  EXPECT_DOUBLE_EQ(session.read("G4 P-5").dwell_s, 0.0);
}

TEST(RrfBlocks, MakeTheirLinesUncertain) {
  Session session(default_options(Firmware::rrf));
  session.read("M83\nG1 X1 Y1 Z1\nif true");
  EXPECT_EQ(session.read("  G1 X50 Y50").kind, EventKind::barrier);
  EXPECT_DOUBLE_EQ(session.state().position_mm[X], 1.0);
  EXPECT_THAT(session.read("  M106 S1").warnings, IsEmpty());
  session.read("G1 X2 Y2 Z1");  // outside
  EXPECT_TRUE(session.move("G1 X3").start_known);
}

TEST(RrfBlocks, EndWhereTheIndentationDoes) {
  Session session(default_options(Firmware::rrf));
  session.read("G1 X1 Y1 Z1\n  if true\n    G1 X9\n    while true\n      G1 X8\n    G1 X7");
  EXPECT_FALSE(session.read("  G1 X1 Y1 Z1").position_lost) << "beside the if, not in it";
  EXPECT_TRUE(session.move("  G1 X2").start_known);
}

TEST(RrfBlocks, ThatSetAModeLeaveTheRestAsItIs) {
  for (const char* line :
       {"  M220 S{global.factor}", "  M204 P{global.accel}", "  M82", "  G91", "  G20",
        "  M220 S50", "  M204 P500", "  M200 D1.75", "  M593 P\"none\"", "  M121"}) {
    Session session(default_options(Firmware::rrf));
    session.read("M120\nM83\nG1 X1 Y1 Z1\nif true");
    EXPECT_THAT(session.read(line).warnings, SizeIs(1)) << line;
    EXPECT_THAT(session.read(line).warnings, IsEmpty()) << "said once";
    session.read("G1 X1 Y1 Z1");
    EXPECT_FALSE(session.move("G1 X2").start_known) << line;
  }
}

TEST(RrfBlocks, ThatSetTheSpeedDoNotMatterAfterTheNext) {
  Session session(default_options(Firmware::rrf));
  session.read("G1 X1 Y1 Z1\nif true\n  G1 X5 F600\nG1 X1 Y1 Z1");
  EXPECT_FALSE(session.move("G1 X2").start_known);
  EXPECT_TRUE(session.move("G1 X3 F3000").start_known);
}

TEST(RrfShaper, IsKeptForItsRestoration) {
  InterpreterOptions options = default_options(Firmware::rrf);
  options.shaper_freq_hz.x = options.shaper_freq_hz.y = 40.0;
  options.shaper_type = "mzv";
  Session session(options);
  EXPECT_EQ(session.state().shaper.settings.type.x, "mzv");
  session.read("M593 P\"none\"");
  EXPECT_EQ(session.state().shaper.freq_hz.x, 0.0);
  EXPECT_EQ(session.state().shaper.settings.type.x, "none");
  session.read("M593 P\"ZVDD\"");
  EXPECT_EQ(session.state().shaper.freq_hz.x, 40.0) << "the frequency was kept";
  EXPECT_EQ(session.state().shaper.settings.type.y, "zvdd");
  session.read("M593 F50 S0.2");
  EXPECT_EQ(session.state().shaper.freq_hz.y, 50.0);
  EXPECT_EQ(session.state().shaper.settings.damping_ratio.x, 0.2);
  EXPECT_EQ(session.read("M593 L0.3").kind, EventKind::barrier)
      << "it would switch on a shaper that is off within a run";
  session.read("M593 P\"custom\" H0.4:0.7 T0.01:0.01");
  EXPECT_EQ(session.state().shaper.settings.custom_words, "P\"custom\" H0.4:0.7 T0.01:0.01");
}

TEST(RrfShaper, ThatIsOffTakesAFrequencyForZvd) {
  Session session(default_options(Firmware::rrf));
  EXPECT_EQ(session.state().shaper.freq_hz.x, 0.0);
  session.read("M593 F35");
  EXPECT_EQ(session.state().shaper.freq_hz.x, 35.0);
  EXPECT_EQ(session.state().shaper.settings.type.x, "zvd");
  session.read("M593 P\"none\"\nM593 P\"mzv\"");
  EXPECT_EQ(session.state().shaper.freq_hz.x, 35.0);
}

TEST(RrfJerk, IsTwoFrom3_6On) {
  InterpreterOptions options = default_options(Firmware::rrf);
  Interpreter before(options);
  EXPECT_FALSE(before.interpret({"M566 X600", 1}).limits->axis_max_jerk_mm_s[X]);
  options.has_print_jerk = true;
  Interpreter since(options);
  const Event both = since.interpret({"M566 X600", 1});
  EXPECT_EQ(both.limits->axis_max_jerk_mm_s[X], 10.0);
  EXPECT_EQ(both.limits->axis_jerk_mm_s[X], 10.0);
  const Event of_prints = since.interpret({"M205 X8", 1});
  EXPECT_FALSE(of_prints.limits->axis_max_jerk_mm_s[X]);
  EXPECT_EQ(of_prints.limits->axis_jerk_mm_s[X], 8.0);
}

}  // namespace
}  // namespace unflex::gcode
