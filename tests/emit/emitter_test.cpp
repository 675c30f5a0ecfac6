// The text around and inside runs, line by line.
#include "unflex/emit/emitter.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "plain_emission.hpp"

namespace unflex::emit {
namespace {

using ::testing::ElementsAre;
using testing::emit;
using ::testing::HasSubstr;
using ::testing::IsSupersetOf;
using testing::lines_of;
using ::testing::Not;
using testing::options;
using ::testing::StartsWith;

const std::string kHead = "G90\nM83\nG1 X0 Y0 Z0.2 F6000\n";
const std::string kRaise =
    "SET_VELOCITY_LIMIT VELOCITY=1200 ACCEL=1000000 SQUARE_CORNER_VELOCITY=1000 "
    "MINIMUM_CRUISE_RATIO=0 ACCEL_TO_DECEL=1000000\n";
const std::string kRestore =
    "SET_VELOCITY_LIMIT VELOCITY=300 ACCEL=5000 SQUARE_CORNER_VELOCITY=5 "
    "MINIMUM_CRUISE_RATIO=0.5 ACCEL_TO_DECEL=2500\n";
const std::string kEnd = ";unflex end\n";
const std::string kShaperOff = "SET_INPUT_SHAPER SHAPER_FREQ_X=0 SHAPER_FREQ_Y=0\n";
const std::string kShaperOn = "SET_INPUT_SHAPER SHAPER_FREQ_X=45 SHAPER_FREQ_Y=45\n";

// The emitted lines, where each group of strokes is replaced by one "~".
std::vector<std::string> outline(const std::string& text) {
  std::vector<std::string> result;
  for (const std::string& line : lines_of(text)) {
    if (!line.starts_with("G1 X") && !line.starts_with("G1 Y")) {
      result.push_back(line);
    } else if (result.empty() || result.back() != "~") {
      result.emplace_back("~");
    }
  }
  return result;
}

// The outline from the first mark of a run on.
std::vector<std::string> from_first_run(const std::string& input,
                                        const EmitOptions& how = options()) {
  const std::string text = emit(input, how).text;
  const std::size_t mark = text.find(";unflex run");
  EXPECT_NE(mark, std::string::npos);
  return outline(text.substr(std::min(mark, text.size())));
}

TEST(Emitter, PutsLimitsSpeedAndShaperAroundARun) {
  const std::string text = emit(kHead + "G1 X10 E1 F3000\nG1 Y10 E1\nM104 S0\n", options()).text;
  ASSERT_THAT(text, StartsWith(kHead));
  EXPECT_THAT(outline(text.substr(kHead.size())),
              ElementsAre(";unflex test: compensated for Klipper, not to be compensated again\n",
                          kShaperOff, ";unflex run\n", kRaise, "~", kEnd, kRestore, "G1 F3000\n",
                          "M104 S0\n", kShaperOn));
}

EmitOptions with_checkpoints() {
  EmitOptions how = options();
  how.checkpoints = true;
  return how;
}

const std::string kBack = " SHAPER_FREQ_X=45 SHAPER_FREQ_Y=45\n";
const std::string kBegins = "UNFLEX_CHECKPOINT RUN=1" + kBack;
const std::string kReached = "UNFLEX_CHECKPOINT" + kBack;
const std::string kShaperIsBack = "UNFLEX_CHECKPOINT\n";

TEST(Emitter, PutsCheckpointsWhereRunsBeginAndEnd) {
  const std::string text =
      emit(kHead + "G1 X10 E1 F3000\nG4 P1\nG1 X0 E1\nM104 S0\n", with_checkpoints()).text;
  ASSERT_THAT(text, StartsWith(kHead));
  EXPECT_THAT(
      outline(text.substr(kHead.size())),
      ElementsAre(";unflex test: compensated for Klipper, not to be compensated again\n",
                  kShaperOff, kBegins, ";unflex run\n", kRaise, "~", kEnd, kRestore, "G1 F3000\n",
                  kReached, "G4 P1\n", kBegins, ";unflex run\n", kRaise, "~", kEnd, kRestore,
                  "G1 F3000\n", kReached, "M104 S0\n", kShaperOn, kShaperIsBack));
}

TEST(Emitter, TellsOfTheShaperBeforeTheMachineMovesByItself) {
  EXPECT_THAT(
      from_first_run(kHead + "G1 X10 E1\nPAUSE\nG1 X0 Y0 Z.2 F6000\nG1 X10 E1\nM84\n",
                     with_checkpoints()),
      ElementsAre(";unflex run\n", kRaise, "~", kEnd, kRestore, "G1 F6000\n", kReached, kShaperOn,
                  kShaperIsBack, "PAUSE\n", "~", kShaperOff, kBegins, ";unflex run\n", kRaise, "~",
                  kEnd, kRestore, "G1 F6000\n", kReached, kShaperOn, kShaperIsBack, "M84\n"));
}

// A pause must restore the shaper that the file itself has set there.
TEST(Emitter, TellsOfAShaperThatTheFileSetsBetweenRuns) {
  EXPECT_THAT(
      from_first_run(kHead + "G1 X10 E1\nSET_INPUT_SHAPER SHAPER_FREQ_X=50\nG4 P1\nG1 X0 E1\n",
                     with_checkpoints()),
      ElementsAre(";unflex run\n", kRaise, "~", kEnd, kRestore, "G1 F6000\n", kReached,
                  "SET_INPUT_SHAPER SHAPER_FREQ_X=50\n", "UNFLEX_CHECKPOINT SHAPER_FREQ_Y=45\n",
                  "G4 P1\n", "SET_INPUT_SHAPER SHAPER_FREQ_X=0\n",
                  "UNFLEX_CHECKPOINT RUN=1 SHAPER_FREQ_X=50 SHAPER_FREQ_Y=45\n", ";unflex run\n",
                  kRaise, "~", kEnd, kRestore, "G1 F6000\n",
                  "UNFLEX_CHECKPOINT SHAPER_FREQ_X=50 SHAPER_FREQ_Y=45\n",
                  "SET_INPUT_SHAPER SHAPER_FREQ_X=50 SHAPER_FREQ_Y=45\n", kShaperIsBack));
}

// Checkpoints change nothing else in the output, but for the command that raises limits again
// behind those of the file.
TEST(Emitter, AddsNothingButCheckpoints) {
  const std::string input = kHead +
                            "G1 X10 E1\nM204 S700\nG1 Y10 E1\nG28 X\nG1 X20 Y10 F3000\n"
                            "G1 X10 E1\nG1 Z2\nG1 Y0 E1\n";
  std::string stripped;
  for (const std::string& line : lines_of(emit(input, with_checkpoints()).text)) {
    stripped += line.starts_with("UNFLEX_CHECKPOINT")     ? ""
                : line == "UNFLEX_LIMITS ACCEL=1000000\n" ? "SET_VELOCITY_LIMIT ACCEL=1000000\n"
                                                          : line;
  }
  EXPECT_EQ(stripped, emit(input, options()).text);
}

TEST(Emitter, MarksItsFirstRunOnly) {
  const std::string text =
      emit(kHead + "G1 X10 E1 F3000\nG4 P1\nG1 X0 E1\nG4 P1\nG1 X10 E1\n", options()).text;
  const auto count = [&](const std::string& what) {
    std::size_t found = 0;
    for (const std::string& line : lines_of(text)) {
      found += line.starts_with(what) ? 1 : 0;
    }
    return found;
  };
  EXPECT_EQ(count(";unflex test"), 1U);
  EXPECT_EQ(count(";unflex run"), 3U);
  EXPECT_EQ(count("SET_VELOCITY_LIMIT VELOCITY=1200"), 3U);
  EXPECT_EQ(count("SET_VELOCITY_LIMIT VELOCITY=300"), 3U);
  EXPECT_EQ(count("SET_INPUT_SHAPER"), 2U);
}

TEST(Emitter, CopiesAFileWithoutRunsByteForByte) {
  const std::string input = "; nothing\r\nG28\nG1 Z5\n\n  M84 \n;last";
  EXPECT_EQ(emit(input, options()).text, input);
}

TEST(Emitter, KeepsAnAccelerationInsideARunAndRaisesItAgainAtOnce) {
  EXPECT_THAT(from_first_run(kHead + "G1 X10 E1\nM204 S700\nG1 Y10 E1\nG4 P1\n"),
              ElementsAre(";unflex run\n", kRaise, "~", "M204 S700\n",
                          "SET_VELOCITY_LIMIT ACCEL=1000000\n", "~", kEnd,
                          "SET_VELOCITY_LIMIT VELOCITY=300 ACCEL=700 SQUARE_CORNER_VELOCITY=5 "
                          "MINIMUM_CRUISE_RATIO=0.5 ACCEL_TO_DECEL=2500\n",
                          "G1 F6000\n", "G4 P1\n", kShaperOn));
}

// The run ends after the motion that follows the passive line, although that motion is too short
// for a line of its own.
TEST(Emitter, EndsARunBehindAllThatTheInputHasInIt) {
  EmitOptions how = options();
  how.lines.min_line_s = 0.03;
  EXPECT_THAT(
      from_first_run(kHead + "G1 X10 E1\nM204 S700\nG1 X10.01 E.001\nM104 S0\nG4 P1\n", how),
      ElementsAre(";unflex run\n", kRaise, "~", "M204 S700\n", kEnd,
                  "SET_VELOCITY_LIMIT VELOCITY=300 SQUARE_CORNER_VELOCITY=5 "
                  "MINIMUM_CRUISE_RATIO=0.5 ACCEL_TO_DECEL=2500\n",
                  "G1 F6000\n", "M104 S0\n", "G4 P1\n", kShaperOn));
}

TEST(Emitter, KeepsVelocityLimitsInsideARunAndRaisesThemAgainAtOnce) {
  EXPECT_THAT(
      from_first_run(kHead + "G1 X10 E1\nset_velocity_limit velocity=80 square_corner_velocity=3\n"
                             "G1 Y10 E1\nG4 P1\n"),
      ElementsAre(";unflex run\n", kRaise, "~",
                  "set_velocity_limit velocity=80 square_corner_velocity=3\n",
                  "SET_VELOCITY_LIMIT VELOCITY=1200 SQUARE_CORNER_VELOCITY=1000\n", "~", kEnd,
                  "SET_VELOCITY_LIMIT VELOCITY=80 ACCEL=5000 SQUARE_CORNER_VELOCITY=3 "
                  "MINIMUM_CRUISE_RATIO=0.5 ACCEL_TO_DECEL=2500\n",
                  "G1 F6000\n", "G4 P1\n", kShaperOn));
}

// On many printers M205 is a macro that sets the square corner velocity.
TEST(Emitter, SetsAllLimitsOfARunAgainAfterWhatMayBeAMacroOfLimits) {
  EXPECT_THAT(from_first_run(kHead + "G1 X10 E1\nM205 X8 Y8\nG1 Y10 E1\nG4 P1\n"),
              ElementsAre(";unflex run\n", kRaise, "~", "M205 X8 Y8\n", kRaise, "~", kEnd, kRestore,
                          "G1 F6000\n", "G4 P1\n", kShaperOn));
}

// Klipper of 2024 converts ACCEL_TO_DECEL to a ratio, which must not hold in the run.
TEST(Emitter, SetsAllLimitsOfARunAgainAfterAccelToDecel) {
  EXPECT_THAT(
      from_first_run(kHead + "G1 X10 E1\nSET_VELOCITY_LIMIT ACCEL=5000 ACCEL_TO_DECEL=2000\n"
                             "G1 Y10 E1\nG4 P1\n"),
      ElementsAre(";unflex run\n", kRaise, "~",
                  "SET_VELOCITY_LIMIT ACCEL=5000 ACCEL_TO_DECEL=2000\n", kRaise, "~", kEnd,
                  "SET_VELOCITY_LIMIT VELOCITY=300 ACCEL=5000 SQUARE_CORNER_VELOCITY=5 "
                  "MINIMUM_CRUISE_RATIO=0.5 ACCEL_TO_DECEL=2000\n",
                  "G1 F6000\n", "G4 P1\n", kShaperOn));
}

// ACCEL_TO_DECEL is given even if the ratio has not changed.
TEST(Emitter, SetsNoAccelToDecelWithoutARatio) {
  EXPECT_THAT(
      from_first_run("SET_VELOCITY_LIMIT MINIMUM_CRUISE_RATIO=0\n" + kHead + "G1 X10 E1\nG4 P1\n"),
      IsSupersetOf({kRaise, std::string("SET_VELOCITY_LIMIT VELOCITY=300 ACCEL=5000 "
                                        "SQUARE_CORNER_VELOCITY=5 MINIMUM_CRUISE_RATIO=0 "
                                        "ACCEL_TO_DECEL=2500\n")}));
}

TEST(Emitter, RestoresLimitsThatWereSetBeforeTheRun) {
  EXPECT_THAT(from_first_run("M204 S1234.5\n" + kHead + "G1 X10 E1\nG4 P1\n"),
              ::testing::Contains(
                  "SET_VELOCITY_LIMIT VELOCITY=300 ACCEL=1234.5 "
                  "SQUARE_CORNER_VELOCITY=5 MINIMUM_CRUISE_RATIO=0.5 ACCEL_TO_DECEL=2500\n"));
}

TEST(Emitter, GivesTheShaperBackBeforeTheMachineMovesByItself) {
  for (const std::string line : {"G28\n", "PARK_HEAD\n", "T1\n", "M600\n"}) {
    EXPECT_THAT(from_first_run(kHead + "G1 X10 E1\n" + line + kHead + "G1 X20 E1\n"),
                ElementsAre(";unflex run\n", kRaise, "~", kEnd, kRestore, "G1 F6000\n", kShaperOn,
                            line, "G90\n", "M83\n", "~", kShaperOff, ";unflex run\n", kRaise, "~",
                            kEnd, kRestore, "G1 F6000\n", kShaperOn));
  }
}

EmitOptions with_pressure(Firmware firmware, double printers_own_s) {
  EmitOptions how = options();
  how.interpreter.firmware = how.fixed.firmware = firmware;
  how.fixed.pressure_advance_s = printers_own_s;
  how.pressure.is_written = true;
  how.pressure.printer_presses = firmware == Firmware::klipper;
  return how;
}

// Lines of the text that set pressure advance.
std::vector<std::string> advances(const std::string& text) {
  std::vector<std::string> result;
  for (const std::string& line : outline(text)) {
    if (line.find("ADVANCE=") != std::string::npos || line.starts_with("M572")) {
      result.push_back(line);
    }
  }
  return result;
}

const std::string kLays = kHead + "G1 X10 E1 F3000\nG1 E-1\nG1 E1\nG1 Y10 E1\nM104 S0\n";

// What Klipper advances by itself needs no other advance between runs.
TEST(Emitter, LetsKlipperAdvanceWithLessSmoothing) {
  const EmitOptions how = with_pressure(Firmware::klipper, 0.04);
  EXPECT_THAT(advances(emit(kLays, how).text),
              ElementsAre("SET_PRESSURE_ADVANCE ADVANCE=0.04 SMOOTH_TIME=0.008\n",
                          "SET_PRESSURE_ADVANCE ADVANCE=0.04 SMOOTH_TIME=0.04\n"));
  const std::string of_file = "SET_PRESSURE_ADVANCE ADVANCE=0.4 SMOOTH_TIME=0.02\n";
  EXPECT_THAT(
      advances(emit(of_file + kLays, how).text),
      ElementsAre(of_file, "SET_PRESSURE_ADVANCE ADVANCE=0.4 SMOOTH_TIME=0.0114\n", of_file))
      << "the file's own counts";
  const std::string of_extruder = "SET_PRESSURE_ADVANCE EXTRUDER=extruder ADVANCE=0.03\n";
  EXPECT_THAT(
      advances(emit(of_extruder + kLays, how).text),
      ElementsAre(of_extruder,
                  "SET_PRESSURE_ADVANCE EXTRUDER=extruder ADVANCE=0.03 SMOOTH_TIME=0.008\n",
                  "SET_PRESSURE_ADVANCE EXTRUDER=extruder ADVANCE=0.03 SMOOTH_TIME=0.04\n"));
  EXPECT_THAT(advances(emit(kLays, with_pressure(Firmware::klipper, 0.0)).text), ElementsAre());
  EmitOptions other = how;
  other.pressure.hotend.advance_s = 0.05;
  EXPECT_THAT(advances(emit(kLays + "G1 X0 Z1 E1\n", other).text),
              ElementsAre("SET_PRESSURE_ADVANCE ADVANCE=0.05 SMOOTH_TIME=0.008\n",
                          "SET_PRESSURE_ADVANCE ADVANCE=0.04\n",
                          "SET_PRESSURE_ADVANCE ADVANCE=0.04 SMOOTH_TIME=0.04\n"))
      << "what is laid between runs gets the printer's own";
  EmitOptions shorter = how;
  shorter.fixed.pressure_advance_smooth_s = 0.003;
  EXPECT_THAT(advances(emit(kLays, shorter).text), ElementsAre());
}

TEST(Emitter, SwitchesPressureAdvanceOffWhereRunsAdvanceByThemselves) {
  EXPECT_THAT(advances(emit(kLays, with_pressure(Firmware::rrf, 0.04)).text),
              ElementsAre("M572 D0 S0\n", "M572 D0 S0.04\n"));
  EmitOptions bent = with_pressure(Firmware::klipper, 0.04);
  bent.pressure.printer_presses = false;
  bent.pressure.hotend.shape = dynamics::PressureShape::tanh;
  bent.pressure.hotend.offset_mm = 0.02;
  EXPECT_THAT(advances(emit(kLays, bent).text), ElementsAre("SET_PRESSURE_ADVANCE ADVANCE=0\n",
                                                            "SET_PRESSURE_ADVANCE ADVANCE=0.04\n"));
}

TEST(Emitter, GivesPressureAdvanceBackBeforeTheMachineMovesByItself) {
  const std::string text = emit(kHead + "G1 X10 E1 F3000\nSOME_MACRO\nG1 X0 Y0 Z0.2\nG1 Y10 E1\n",
                                with_pressure(Firmware::klipper, 0.04))
                               .text;
  EXPECT_THAT(text, HasSubstr("SET_PRESSURE_ADVANCE ADVANCE=0.04 SMOOTH_TIME=0.04\nSOME_MACRO\n"));
  EXPECT_EQ(advances(text).size(), 4U) << "and sets it again";
}

TEST(Emitter, LeavesTheShaperOffOverPausesAndRetractions) {
  EXPECT_THAT(
      from_first_run(kHead + "G1 X10 E1\nG4 P10\nM400\nG1 E-1 F2400\nG1 X20 F6000\nG1 E1\n"),
      ElementsAre(";unflex run\n", kRaise, "~", kEnd, kRestore, "G1 F6000\n", "G4 P10\n", "M400\n",
                  "G1 E-1 F2400\n", ";unflex run\n", kRaise, "~", kEnd, kRestore, "G1 F6000\n",
                  "G1 E1\n", kShaperOn));
}

// A macro may set the shaper of either axis, so it is switched off for both.
TEST(Emitter, GivesBackNoShaperToTheAxisThatHasNone) {
  EmitOptions how = options();
  how.interpreter.shaper_freq_hz.x = 0.0;
  how.interpreter.shaper_freq_hz.y = 37.5;
  const std::string input = kHead + "G1 X10 E1\nG4 P1\n";
  EXPECT_THAT(emit(input, how).text, HasSubstr("\n" + kShaperOff));
  EXPECT_THAT(emit(input, how).text, HasSubstr("\nSET_INPUT_SHAPER SHAPER_FREQ_Y=37.5\n"));
  how.interpreter.shaper_freq_hz.y = 0.0;
  EXPECT_THAT(emit(input, how).text, Not(HasSubstr("SET_INPUT_SHAPER")));
}

const std::string kStaysOff =
    ";unflex: the printer's own input shaper is not known and still off; set it again as its "
    "configuration has it: ";

TEST(Emitter, SaysWhichShaperItCannotGiveBack) {
  EmitOptions how = options();
  how.interpreter.shaper_freq_hz.x = how.interpreter.shaper_freq_hz.y = 0.0;
  how.interpreter.shaper_unknown.x = how.interpreter.shaper_unknown.y = true;
  const std::string input = kHead + "G1 X10 E1\nG4 P1\n";
  const std::string text = emit(input, how).text;
  EXPECT_THAT(text, HasSubstr("\n" + kShaperOff));
  EXPECT_THAT(text, ::testing::EndsWith("\nG4 P1\n" + kStaysOff +
                                        "SET_INPUT_SHAPER SHAPER_FREQ_X=... SHAPER_FREQ_Y=...\n"));
  // What the file sets is known.
  const std::string set = emit(kHead + "SET_INPUT_SHAPER SHAPER_FREQ_Y=41\nG1 X10 E1\n", how).text;
  EXPECT_THAT(set, ::testing::EndsWith("\nSET_INPUT_SHAPER SHAPER_FREQ_Y=41\n" + kStaysOff +
                                       "SET_INPUT_SHAPER SHAPER_FREQ_X=...\n"));
  // Without a run nothing was switched off.
  EXPECT_THAT(emit("G28\n", how).text, Not(HasSubstr("SET_INPUT_SHAPER")));
}

// What follows a line may have switched the shaper on, as tool changers' macros do.
TEST(Emitter, SwitchesAnUnknownShaperOffAgainBehindAllThatMayHaveSetIt) {
  EmitOptions how = options();
  how.interpreter.shaper_freq_hz.x = how.interpreter.shaper_freq_hz.y = 0.0;
  how.interpreter.shaper_unknown.x = how.interpreter.shaper_unknown.y = true;
  for (const std::string line : {"T1\n", "PARK_HEAD\n", "M600\n"}) {
    EXPECT_THAT(from_first_run(kHead + "G1 X10 E1\n" + line + kHead +
                                   "G1 X20 E1\n"
                                   "G4 P1\nG1 X30 E1\n",
                               how),
                ElementsAre(";unflex run\n", kRaise, "~", kEnd, kRestore, "G1 F6000\n", line,
                            "G90\n", "M83\n", "~", kShaperOff, ";unflex run\n", kRaise, "~", kEnd,
                            kRestore, "G1 F6000\n", "G4 P1\n", ";unflex run\n", kRaise, "~", kEnd,
                            kRestore, "G1 F6000\n",
                            kStaysOff + "SET_INPUT_SHAPER SHAPER_FREQ_X=... SHAPER_FREQ_Y=...\n"));
  }
}

EmitOptions options_of(Firmware firmware) {
  EmitOptions how = options();
  how.fixed.firmware = firmware;
  how.interpreter = gcode::default_options(firmware);
  return how;
}

std::size_t count_of(const std::string& line, const std::string& text) {
  const std::vector<std::string> lines = lines_of(text);
  return static_cast<std::size_t>(std::ranges::count(lines, line));
}

TEST(Emitter, SwitchesTheShapersOfOtherFirmwaresOffThatNobodyHasNamed) {
  const std::string runs =
      "G28\n" + kHead + "G1 X10 E1\nG4 P1\nG1 X20 E1\nT1\n" + kHead + "G1 X30 E1\nG1 X40 E1\n";
  EmitOptions how = options_of(Firmware::marlin);
  how.interpreter.shaper_unknown.x = how.interpreter.shaper_unknown.y = true;
  const std::string marlin = emit(runs, how).text;
  EXPECT_EQ(count_of("M593 X F0\n", marlin), 2U) << marlin;
  EXPECT_EQ(count_of("M593 Y F0\n", marlin), 2U);
  EXPECT_THAT(marlin, ::testing::EndsWith(kStaysOff + "M593 X F... and M593 Y F...\n"));
  // A Marlin that was built without input shaping knows no M593.
  how.interpreter.shaper_unknown.x = how.interpreter.shaper_unknown.y = false;
  EXPECT_THAT(emit(runs, how).text, Not(HasSubstr("M593")));

  // On RepRapFirmware a tool's macros may switch it on, whatever config.g says.
  how = options_of(Firmware::rrf);
  EXPECT_EQ(count_of("M593 P\"none\"\n", emit(runs, how).text), 2U);
  how.interpreter.shaper_unknown.x = how.interpreter.shaper_unknown.y = true;
  EXPECT_THAT(emit(runs, how).text, ::testing::EndsWith(kStaysOff + "M593 P\"...\" F...\n"));
}

TEST(Emitter, WritesRelativeFilamentAndReturnsToAbsolute) {
  const std::string input = "G90\nM82\nG92 E0\nG1 X0 Y0 Z0.2 F6000\nG1 X10 E1\nG1 Y10 E2\nG4 P1\n";
  EXPECT_THAT(from_first_run(input),
              ElementsAre(";unflex run\n", kRaise, "M83\n", "~", kEnd, kRestore, "M82\n",
                          "G1 F6000\n", "G4 P1\n", kShaperOn));
}

TEST(Emitter, PutsTheZeroOfFilamentRightThatARunHasSplit) {
  // G92 E0 in the middle of a run: E after the run must count exactly from there.
  const std::string input =
      "G90\nM82\nG92 E0\nG1 X0 Y0 Z0.2 F6000\nG1 X10 E0.123456\nG92 E0\nG1 Y10 E0.5\nG4 P1\n"
      "G1 X3 E0.7\n";
  double laid = 0.0;
  gcode::Interpreter interpreter;
  for (const std::string& line : lines_of(emit(input, options()).text)) {
    for (const gcode::Segment& segment : interpreter.interpret({line, 0}).segments) {
      laid += segment.delta(gcode::E);
    }
  }
  EXPECT_NEAR(laid, 0.123456 + 0.7, 1e-5);
  EXPECT_NEAR(interpreter.state().position_mm[gcode::E] - interpreter.state().base_mm[gcode::E],
              0.7, 1e-5);
}

// A macro may have changed E. The file's next absolute E counts from there, so the emitter must not
// set E.
TEST(Emitter, SaysNothingOfAReadingOfFilamentThatAMacroHasLeft) {
  const std::string beginning = "G90\nM83\nG92 E0\nG1 X0 Y0 Z0.2 F6000\n";
  const std::string run = "G1 X10 E0.333333\nG1 X20 E0.333333\nM221 S90\nG1 Y10 E0.333333\n";
  const std::string after = "SOME_MACRO\nG1 X0 Y0 Z0.2\n";
  const auto zeros = [](const std::string& input) {
    return std::ranges::count_if(lines_of(emit(input, options()).text),
                                 [](const std::string& line) { return line.starts_with("G92 E"); });
  };
  EXPECT_EQ(zeros(beginning + run + "G4 P1\n"), 2);
  EXPECT_EQ(zeros(beginning + after + run + "G4 P1\n"), 1);
}

TEST(Emitter, WritesMillimetresAndAbsolutePlacesWhateverTheFileDoes) {
  EXPECT_THAT(
      from_first_run("G91\nG20\nM83\nG90\nG1 X0 Y0 Z0.01 F236\nG91\nG1 X0.4 E0.04\nG4 P1\n"),
      ElementsAre(";unflex run\n", "G21\n", kRaise, "G90\n", "~", kEnd, kRestore, "G91\n", "G20\n",
                  "G1 F236\n", "G4 P1\n", kShaperOn));
}

TEST(Emitter, FollowsModesThatChangeInsideARun) {
  const std::string input = kHead +
                            "G1 X10 E1\nG91\nG1 Y10 E1\nG20\nG1 X0.1 E0.01\nG90\nM82\nG1 Y0 E0.2\n"
                            "G21\nM400\n";
  const std::vector<std::string> lines = from_first_run(input);
  EXPECT_THAT(
      lines, ElementsAre(";unflex run\n", kRaise, "~", "G91\n", "G90\n", "~", "G20\n", "G21\n", "~",
                         "G90\n", "M82\n", "M83\n", "~", kEnd, kRestore, "M82\n", "G20\n",
                         "G1 F236.220472441\n", "G21\n", "M400\n", kShaperOn));
}

TEST(Emitter, KeepsTheLineEndingsOfTheFile) {
  const std::string text =
      emit("G90\r\nM83\r\nG1 X0 Y0 Z0.2 F6000\r\nG1 X10 E1\r\n;c\r\nG1 Y10 E1\r\nM84\r\n",
           options())
          .text;
  for (const std::string& line : lines_of(text)) {
    EXPECT_TRUE(line.ends_with("\r\n")) << line;
  }
}

TEST(Emitter, ClosesTheLastLineBeforeItAddsOne) {
  EXPECT_THAT(emit(kHead + "G1 X10 E1\nM104 S0", options()).text,
              ::testing::EndsWith("\nM104 S0\n" + kShaperOn));
  EXPECT_THAT(emit(kHead + "G1 X10 E1", options()).text,
              ::testing::EndsWith("\nG1 F6000\n" + kShaperOn));
}

TEST(Emitter, WritesNothingOfARunTooSmallToBeWritten) {
  const testing::Emission emission = emit(kHead + "G1 X0.00004 E0.00001\nG4 P1\n", options());
  EXPECT_EQ(emission.runs, 0U);
  EXPECT_EQ(emission.text, kHead + "G1 X0.00004 E0.00001\nG4 P1\n");
}

TEST(Emitter, EndsARunWhereTheFileDoesEvenBetweenGridPoints) {
  const std::string text = emit(kHead + "G1 X10.12345678 E1\nG4 P1\n", options()).text;
  EXPECT_THAT(text, HasSubstr("\nG1 X10.12345678 "));
}

TEST(Emitter, TriesARunOnACopyWithoutATrace) {
  const std::string input = kHead + "G1 X10 E1\nG4 P1\n";
  std::istringstream stream(input);
  run::PieceReader reader(stream, "in", {}, {}, {});
  Emitter emitter(options());
  std::string out;
  for (run::Piece piece; reader.next(piece).value();) {
    if (piece.is_run) {
      const dynamics::BaseTrajectory base = testing::plan_as_base(piece.moves);
      Emitter trial = emitter;
      std::string thrown_away;
      const emit::Run run{&piece.events, &piece.move_counts, &piece.moves, &base, 0.0};
      trial.run(run, plan_run(run, trial.run_start(), options()), thrown_away);
      EXPECT_FALSE(thrown_away.empty());
    }
    for (const gcode::Event& event : piece.events) {
      emitter.line(event, out);
    }
  }
  emitter.finish(out);
  EXPECT_EQ(out, input);
}

}  // namespace
}  // namespace unflex::emit
