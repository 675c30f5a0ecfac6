#include "unflex/verify/verify.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "plain_emitter.hpp"
#include "replaying.hpp"

namespace unflex::verify {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::PlainEmitter;
using testing::verify_text;
using testing::violations_of;

constexpr char kPrint[] =
    "; sliced by hand\n"
    "G28\n"
    "G90\n"
    "M83\n"
    "G1 Z0.3 F600\n"
    "G1 X20 Y20 F6000\n"
    "G1 E2 F1800\n"
    "M204 S3000\n"
    ";TYPE:Perimeter\n"
    "G1 F3600\n"
    "G1 X60 Y20 E1.2\n"
    "G1 X60 Y50 E0.9\n"
    "M106 S128\n"
    "M204 S2000\n"
    "G1 X20 Y50 E1.2\n"
    "G1 X20 Y20.5 E0.88\n"
    "G1 X22 Y20.5 E-0.4\n"
    "G1 E-1.6 F1800\n"
    "G1 Z0.7 F600\n"
    "G1 X30 Y30 F9000\n"
    "G1 Z0.3 F600\n"
    "G1 E2 F1800\n"
    ";TYPE:Infill\n"
    "M73 P50 R1\n"
    "G1 X50 Y40 E0.7 F4800\n"
    "G1 X50 Y41 E0.03\n"
    "G1 X30 Y31 E0.7\n"
    "M104 S0\n"
    "G4 P250\n"
    "PRINT_END\n"
    "; bye\n";

std::string replaced(std::string text, const std::string& what, const std::string& with,
                     std::size_t after = 0) {
  const std::size_t at = text.find(what, after);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), with);
}

// The n-th of the short lines that the plain emitter wrote, counted from 0.
std::pair<std::size_t, std::size_t> short_line(const std::string& text, int n) {
  std::size_t at = text.find(";unflex run\n");
  for (int i = -1; i < n; ++i) {
    at = text.find("\nG1 X", at + 1);
  }
  return {at + 1, text.find('\n', at + 1) - at};
}

Rules on_a_bed() {
  Rules rules;
  rules.travel = on_all_axes(TravelRange{0.0, 100.0});
  return rules;
}

class Emitted : public ::testing::Test {
 protected:
  const std::string good_ = PlainEmitter().emit(kPrint);

  VerifyReport check(const std::string& output) { return verify_text(kPrint, output, on_a_bed()); }
  void expect_violation(const std::string& output, const std::string& text) {
    const VerifyReport report = check(output);
    EXPECT_GE(report.violation_count, 1U);
    EXPECT_THAT(violations_of(report), HasSubstr(text));
  }
};

// ---- the sliced file as its own output ---------------------------------------------------------

TEST(Verify, AFileIsItsOwnFaultlessOutput) {
  const VerifyReport report = verify_text(kPrint, kPrint, on_a_bed());
  EXPECT_EQ(violations_of(report), "");
  EXPECT_EQ(report.violation_count, 0U);
  EXPECT_EQ(report.runs, 0U);
  EXPECT_EQ(report.measured.output.lines, 31U);
  EXPECT_EQ(report.measured.output.bytes, std::string(kPrint).size());
  EXPECT_DOUBLE_EQ(report.measured.uncompensated.time_s, report.measured.compensated.time_s);
  EXPECT_NEAR(report.measured.uncompensated.extrusion_mm,
              1.2 + 0.9 + 1.2 + 0.88 - 0.4 - 1.6 + 2 + 2 + 1.43, 1e-9);
  EXPECT_DOUBLE_EQ(report.measured.uncompensated.extrusion_mm,
                   report.measured.compensated.extrusion_mm);
  EXPECT_LT(report.measured.worst_move_extrusion_error_mm, 1e-12);
  EXPECT_EQ(report.measured.base.max_accel_mm_s2, 0.0);
  EXPECT_GT(report.measured.uncompensated.extruding.contour_max_mm, 0.01);
  EXPECT_DOUBLE_EQ(report.measured.uncompensated.extruding.contour_rms_mm,
                   report.measured.compensated.extruding.contour_rms_mm);
  EXPECT_DOUBLE_EQ(report.measured.uncompensated.all.tracking_max_mm,
                   report.measured.compensated.all.tracking_max_mm);
}

TEST(Verify, OfEmptyFilesFindsNothing) {
  const VerifyReport report = verify_text("", "");
  EXPECT_EQ(report.violation_count, 0U);
  EXPECT_EQ(report.measured.uncompensated.time_s, 0.0);
  EXPECT_EQ(report.measured.output.lines, 0U);
}

TEST(Verify, CountsDwellsInThePrintTime) {
  const VerifyReport with = verify_text("G4 P1500\n", "G4 P1500\n");
  EXPECT_NEAR(with.measured.uncompensated.time_s, 1.5, 1e-12);
  EXPECT_NEAR(with.measured.compensated.time_s, 1.5, 1e-12);
}

TEST(Verify, CountsSwitchesOfFiltersInThePrintTime) {
  const std::string there = "G90\nM83\nG28\nG1 X10 Y10 Z1 F6000\nG1 X50 E1\n";
  const std::string back = "G1 X10 E1\n";
  const auto takes_s = [&](const std::string& switches, const std::string& after) {
    return verify_text(there + switches + back + after, there + switches + back + after)
        .measured.compensated.time_s;
  };
  const double plain_s = takes_s("G4 P0\n", "");
  const std::string on = "SET_PRESSURE_ADVANCE ADVANCE=0.05\n";
  const std::string off = "SET_PRESSURE_ADVANCE ADVANCE=0\n";
  EXPECT_NEAR(takes_s(on, ""), plain_s + 0.021, 1e-9);
  EXPECT_NEAR(takes_s(on + off, ""), plain_s + 0.021, 1e-9) << "in a row they are one stop";
  EXPECT_NEAR(takes_s(on, off), plain_s + 0.021, 1e-9) << "nothing follows the last one";
}

TEST(Verify, TheDeviationOfAFileIsThatOfItsPlan) {
  const std::string text =
      "G90\nM83\nG1 Z0.2 F600\nG1 X1 Y1 F600\nG4 P3000\nG1 X40 Y1 E1 F6000\nG1 X40 Y40 E1\n";
  const auto moves = testing::plan_path(
      {{1.0, 1.0, 0.0}, {40.0, 1.0, 100.0, 1.0}, {40.0, 40.0, 100.0, 1.0}}, planner::Limits{});
  const DeviationStats alone = measure(moves, moves, testing::at_rest(moves), {}).extruding.stats();
  const DeviationStats in_file = verify_text(text, text).measured.uncompensated.extruding;
  // The swing after the positioning has died down by e^{-51} in three seconds.
  EXPECT_NEAR(in_file.contour_max_mm, alone.contour_max_mm, 1e-9);
  EXPECT_NEAR(in_file.contour_rms_mm, alone.contour_rms_mm, 1e-9);
  EXPECT_NEAR(in_file.tracking_rms_mm, alone.tracking_rms_mm, 1e-9);
  EXPECT_NEAR(in_file.duration_s, alone.duration_s, 1e-9);
  EXPECT_EQ(in_file.contour_max_line, alone.contour_max_line + 5);
}

TEST(Verify, HoldsTheBaseAfterTheEnd) {
  const std::string text = "G90\nG1 Z0.2 F600\nG1 X1 Y1 F6000\nG1 X40 Y1 F1500\n";
  Rules rules;
  rules.nozzle.hold_s = 0.0;
  const VerifyReport without = verify_text(text, text, rules);
  rules.nozzle.hold_s = 0.75;
  const VerifyReport with = verify_text(text, text, rules);
  EXPECT_NEAR(with.measured.uncompensated.all.duration_s,
              without.measured.uncompensated.all.duration_s + 0.75, 1e-9);
  EXPECT_DOUBLE_EQ(with.measured.uncompensated.time_s, without.measured.uncompensated.time_s);
  // Braking takes less than a quarter of a period, so the nozzle swings furthest afterwards.
  EXPECT_GT(with.measured.uncompensated.all.contour_max_mm,
            1.2 * without.measured.uncompensated.all.contour_max_mm);
}

// ---- a run drawn in short lines ----------------------------------------------------------------

TEST_F(Emitted, AFaithfulCopyInShortLinesIsFaultless) {
  const VerifyReport report = check(good_);
  EXPECT_EQ(violations_of(report), "") << good_;
  EXPECT_EQ(report.runs, 3U);
  EXPECT_NEAR(report.measured.compensated.time_s, report.measured.uncompensated.time_s,
              0.01 * report.measured.uncompensated.time_s);
  EXPECT_NEAR(report.measured.uncompensated.extrusion_mm, report.measured.compensated.extrusion_mm,
              1e-9);
  EXPECT_LT(report.measured.worst_move_extrusion_error_mm, 1.1e-5);
  EXPECT_NEAR(report.measured.output.segment_ms_median, 2.0, 0.05);
  EXPECT_GE(report.measured.output.max_lines_per_s, 480.0);
  EXPECT_LE(report.measured.output.max_lines_per_s, 520.0);
  // The travel to X30 Y30 peaks at v² = aL(1 − minimum cruise ratio).
  const double travel_mm = std::hypot(8.0, 9.5);
  EXPECT_NEAR(report.measured.base.max_velocity_mm_s,
              std::sqrt(1000.0 * travel_mm) * 9.5 / travel_mm, 1.0);
  EXPECT_GT(report.measured.base.max_accel_mm_s2, 1900.0);
  EXPECT_LT(report.measured.base.max_accel_mm_s2, 8000.0);
  EXPECT_LT(report.measured.worst_run_drift_s, 5e-4);
  // The copy does not compensate, so it deviates as before.
  EXPECT_NEAR(report.measured.compensated.extruding.contour_rms_mm,
              report.measured.uncompensated.extruding.contour_rms_mm,
              0.05 * report.measured.uncompensated.extruding.contour_rms_mm);
  // The sliced file passes through a corner into its wipe. The emitted file rests there.
  EXPECT_GT(report.measured.compensated.extruding.duration_s,
            report.measured.uncompensated.extruding.duration_s);
  EXPECT_LT(report.measured.compensated.extruding.duration_s,
            report.measured.uncompensated.extruding.duration_s + 0.01);
}

TEST_F(Emitted, ALostLineIsFound) {
  expect_violation(replaced(good_, "M106 S128\n", ""), "in.gcode:13: line 'M106 S128' is lost");
  expect_violation(replaced(good_, ";TYPE:Infill\n", ""),
                   "in.gcode:23: line ';TYPE:Infill' is lost");
}

TEST_F(Emitted, AChangedCommentIsFound) {
  const std::string changed = replaced(good_, ";TYPE:Perimeter", ";TYPE:perimeter");
  expect_violation(changed, "in.gcode:9: line ';TYPE:Perimeter' is lost or changed");
  expect_violation(changed, "';TYPE:perimeter' is neither the sliced file's nor");
}

TEST_F(Emitted, AChangedLineEndingIsFound) {
  expect_violation(replaced(good_, "M106 S128\n", "M106 S128\r\n"),
                   "'M106 S128' is lost or changed");
}

TEST_F(Emitted, BlankLinesAndWindowsLineEndingsAreNotMissed) {
  const std::string sliced = replaced(kPrint, "M106 S128\n", "\n \t\nM106 S128\r\n\r\n");
  EXPECT_EQ(violations_of(verify_text(sliced, good_, on_a_bed())), "");
}

TEST_F(Emitted, SwappedLinesAreFound) {
  expect_violation(replaced(good_, ";TYPE:Infill\nM73 P50 R1\n", "M73 P50 R1\n;TYPE:Infill\n"),
                   "';TYPE:Infill'");
}

TEST_F(Emitted, ALineMovedAlongThePathIsFound) {
  std::string moved = replaced(good_, "M106 S128\n", "");
  moved.insert(short_line(moved, 20).first, "M106 S128\n");
  expect_violation(moved, "'M106 S128' moved along the path by");
}

TEST_F(Emitted, AnUnknownLineIsFound) {
  std::string more = good_;
  more.insert(short_line(more, 20).first, "M221 S100\n");
  expect_violation(more, "'M221 S100' is neither the sliced file's nor one that unflex adds");
}

TEST_F(Emitted, ABarrierThatWasAddedChangesTheStructure) {
  std::string more = good_;
  more.insert(short_line(more, 20).first, "G4 P1\n");
  expect_violation(more, "structure differs: 'G4 P1' instead of 'G1 X22 Y20.5 E-0.4'");
}

TEST_F(Emitted, MissingFilamentIsFound) {
  const auto [at, length] = short_line(good_, 50);
  std::string less = good_;
  const std::size_t e = less.find(" E", at);
  ASSERT_LT(e, at + length);
  less.erase(e, less.find(' ', e + 1) - e);
  expect_violation(less, "mm of filament instead of 4.18000 mm");
}

TEST_F(Emitted, FilamentLaidElsewhereIsReported) {
  // All filament of the first wall laid at its beginning.
  std::string heap = good_;
  double moved = 0.0;
  for (int n = 40; n < 120; ++n) {
    const std::size_t e = heap.find(" E", short_line(heap, n).first) + 2;
    moved += 0.001;
    const double filament = std::stod(heap.substr(e));
    heap.replace(e, heap.find(' ', e) - e, fmt::format("{:.5f}", filament - 0.001));
  }
  const std::size_t e = heap.find(" E", short_line(heap, 600).first) + 2;
  const double filament = std::stod(heap.substr(e));
  heap.replace(e, heap.find(' ', e) - e, fmt::format("{:.5f}", filament + moved));
  const VerifyReport report = check(heap);
  EXPECT_NEAR(report.measured.worst_move_extrusion_error_mm, moved, 0.01);
}

TEST_F(Emitted, APlaceOutOfTheTravelIsFound) {
  const auto [at, length] = short_line(good_, 200);
  const std::string out = std::string(good_).replace(at, length, "G1 X60 Y-0.5 E0.001 F30000\n");
  expect_violation(out, "Y-0.5000 is out of the travel by 0.5000 mm");
}

TEST_F(Emitted, APlaceOutOfTheTravelIsAllowedWhereTheSlicedFileGoesThere) {
  Rules rules = on_a_bed();
  rules.travel.y.max_mm = 45.0;
  EXPECT_EQ(violations_of(verify_text(kPrint, good_, rules)), "");
}

TEST_F(Emitted, TooMuchAccelerationIsFound) {
  Rules rules = on_a_bed();
  rules.base_max_accel_mm_s2 = 1500.0;
  const VerifyReport report = verify_text(kPrint, good_, rules);
  EXPECT_THAT(violations_of(report), HasSubstr("is above the limit 1500"));
  EXPECT_GT(report.measured.base.max_accel_mm_s2, 1500.0);
}

TEST_F(Emitted, AccelerationThatThePlanAsksForIsAllowed) {
  Rules rules = on_a_bed();
  rules.base_max_accel_mm_s2 = 1500.0;
  rules.base_accel_times_plan = 2.5;
  EXPECT_EQ(violations_of(verify_text(kPrint, good_, rules)), "");
  rules.base_accel_times_plan = 0.4;
  EXPECT_THAT(violations_of(verify_text(kPrint, good_, rules)), HasSubstr("is above the limit"));
}

TEST_F(Emitted, TooMuchVelocityIsFound) {
  Rules rules = on_a_bed();
  rules.base_max_velocity_mm_s = 55.0;
  EXPECT_THAT(violations_of(verify_text(kPrint, good_, rules)), HasSubstr("base velocity"));
}

// The plain emitter keeps the plan's speeds.
TEST_F(Emitted, TooManyStepsAreFound) {
  Rules rules = on_a_bed();
  rules.steps.steps_per_mm = {80.0, 80.0, 400.0, 0.0};
  const VerifyReport free = verify_text(kPrint, good_, rules);
  EXPECT_EQ(violations_of(free), "");
  const double most_hz = free.emitted_steps.motors[0].hz;
  EXPECT_GT(most_hz, 0.0);
  EXPECT_NEAR(free.sliced_steps.motors[0].hz, most_hz, 0.02 * most_hz);
  EXPECT_THAT(free.sliced_step_breaches, IsEmpty());
  rules.steps.max_hz = 0.9 * most_hz;
  const VerifyReport limited = verify_text(kPrint, good_, rules);
  EXPECT_THAT(violations_of(limited), HasSubstr("motor X makes "));
  EXPECT_GT(limited.violations.front().place.line, 0U);
  ASSERT_FALSE(limited.sliced_step_breaches.empty());
  EXPECT_EQ(limited.sliced_step_breaches.front().line, limited.sliced_steps.motors[0].line);
}

TEST_F(Emitted, TooManyStepsOfTheSlicedFileBreakNoRule) {
  Rules rules = on_a_bed();
  rules.steps.steps_per_mm = {80.0, 80.0, 400.0, 0.0};
  rules.steps.max_hz = 100.0;
  const VerifyReport report = verify_text(kPrint, kPrint, rules);
  EXPECT_EQ(violations_of(report), "");
  EXPECT_FALSE(report.sliced_step_breaches.empty());
}

TEST_F(Emitted, ALineThreeTimesAsFastAsItsNeighboursIsFound) {
  const std::size_t feed = good_.find(" F", short_line(good_, 400).first) + 2;
  const std::size_t end = good_.find('\n', feed);
  const double fast = 3.0 * std::stod(good_.substr(feed, end - feed));
  expect_violation(std::string(good_).replace(feed, end - feed, fmt::format("{:.3f}", fast)),
                   "base acceleration");
}

TEST_F(Emitted, LimitsThatAreNotRestoredAreFound) {
  const std::size_t wipe = good_.find("G1 X22 Y20.5 E-0.4\n");
  const std::size_t restore = good_.rfind("SET_VELOCITY_LIMIT", wipe);
  std::string raised = good_;
  raised.erase(restore, good_.find('\n', restore) + 1 - restore);
  expect_violation(raised, "limits not restored: maximum acceleration is 1e+06 instead of 2000");
}

TEST_F(Emitted, AFeedThatIsNotRestoredIsFound) {
  const std::size_t wipe = good_.find("G1 X22 Y20.5 E-0.4\n");
  const std::size_t feed = good_.rfind("G1 F3600\n", wipe);
  std::string other = good_;
  other.erase(feed, 9);
  expect_violation(other, "state before this line: feed rate is");
}

TEST_F(Emitted, AModeThatIsNotRestoredIsFound) {
  std::string other = good_;
  other.insert(other.find("G1 X22 Y20.5 E-0.4\n"), "M82\n");
  expect_violation(other, "M82/M83 differs");
}

TEST_F(Emitted, AnEndThatIsNotReachedIsFound) {
  const std::size_t wipe = good_.find("G1 X22 Y20.5 E-0.4\n");
  const std::size_t last = good_.rfind("\nG1 X20.0000 Y20.5", wipe);
  const std::string off = replaced(good_, "Y20.5000", "Y20.5020", last);
  expect_violation(off, "state before this line: Y is 20.502 instead of 20.5");
}

TEST_F(Emitted, AKeptMoveThatWasChangedIsFound) {
  expect_violation(replaced(good_, "G1 X22 Y20.5 E-0.4\n", "G1 X22 Y20.6 E-0.4\n"),
                   "structure differs: 'G1 X22 Y20.6 E-0.4' instead of 'G1 X22 Y20.5 E-0.4'");
  expect_violation(replaced(good_, "G1 Z0.7 F600\n", "G1 Z0.8 F600\n"), "structure differs");
  expect_violation(replaced(good_, "G1 E-1.6 F1800\n", ""), "structure differs");
}

TEST_F(Emitted, ATruncatedFileIsFound) {
  expect_violation(good_.substr(0, short_line(good_, 100).first),
                   "structure differs: the end of the file instead of");
  expect_violation(good_.substr(0, good_.find("PRINT_END")), "structure differs");
  expect_violation(good_.substr(0, good_.find("; bye")), "in.gcode:31: line '; bye' is lost");
}

TEST_F(Emitted, ATailOfMovesIsFound) {
  expect_violation(good_ + "G1 X0 Y0\n", "structure differs: 'G1 X0 Y0' instead of the end");
}

TEST_F(Emitted, ARunWithoutAnnouncementMustHaveTheLinesOfTheSlicedFile) {
  expect_violation(replaced(good_, ";unflex run\n", ""), "is neither the sliced file's nor");
  const std::string slower = replaced(kPrint, "G1 X60 Y20 E1.2\n", "G1 X60 Y20 E1.2 F3500\n");
  expect_violation(slower, "'G1 X60 Y20 E1.2' is lost or changed");
}

TEST_F(Emitted, AnAnnouncedRunThatTheSlicedFileDoesNotHaveIsFound) {
  expect_violation(replaced(good_, "PRINT_END\n",
                            ";unflex run\nG1 X29 Y31 F600\nG1 X30 Y31\nG1 F4800\nPRINT_END\n"),
                   "the run before is not in the sliced file");
}

TEST_F(Emitted, AMoveWithTooMuchFilamentIsFound) {
  const auto [at, length] = short_line(good_, 50);
  std::string thick = good_;
  const std::size_t e = thick.find(" E", at) + 2;
  thick.replace(e, thick.find(' ', e) - e, "0.15");
  Rules rules = on_a_bed();
  rules.interpreter.max_extrude_ratio = 0.266080;
  rules.interpreter.max_extrude_dab_mm = 0.106432;
  EXPECT_THAT(violations_of(verify_text(kPrint, thick, rules)),
              HasSubstr("too much for so short a way"));
}

TEST_F(Emitted, ALateClockIsDrift) {
  // Every line is one percent slower, so the run of about three seconds ends 30 ms late.
  Rules rules = on_a_bed();
  const std::string input =
      "G90\nM83\nG1 Z0.3 F600\nG1 X0 Y0.1 F6000\nG4 P2000\nG1 X90 Y0.1 E3 F1800\nM400\n";
  std::string late = PlainEmitter().emit(input);
  for (std::size_t at = late.find(" F1800.000"); at != std::string::npos;
       at = late.find(" F1800.000", at)) {
    late.replace(at, 10, " F1782.000");
  }
  const VerifyReport report = verify_text(input, late, rules);
  EXPECT_NEAR(report.measured.worst_run_drift_s, 0.03, 0.003);
  EXPECT_NEAR(report.measured.compensated.time_s - report.measured.uncompensated.time_s, 0.03,
              0.003);
}

TEST_F(Emitted, StopsThatSetUpTheShaperAreNoSections) {
  std::string shaped = good_;
  for (std::size_t at = shaped.find(";unflex run\n"); at != std::string::npos;
       at = shaped.find(";unflex run\n", at + 40)) {
    shaped.insert(at + 12, "SET_INPUT_SHAPER SHAPER_FREQ_X=0\n");
  }
  shaped.insert(shaped.find("G1 X22 Y20.5 E-0.4\n"), "SET_INPUT_SHAPER SHAPER_FREQ_X=45\n");
  EXPECT_EQ(violations_of(check(shaped)), "");
  EXPECT_EQ(check(shaped).runs, 3U);
}

// The printer's own shaper at 45 Hz on X, as the rules know it.
class Shaped : public Emitted {
 protected:
  static VerifyReport check_shaped(const std::string& output) {
    Rules rules = on_a_bed();
    rules.interpreter.shaper_freq_hz.x = 45.0;
    return verify_text(kPrint, output, rules);
  }
  // The good text with the shaper switched off before the first run, and with the line `restored`
  // before the macro at the end.
  [[nodiscard]] std::string shaped(const std::string& restored) const {
    std::string text = good_;
    text.insert(text.find(";unflex run\n"), "SET_INPUT_SHAPER SHAPER_FREQ_X=0\n");
    return text.insert(text.find("PRINT_END\n"), restored);
  }
};

TEST_F(Shaped, MustBeOffInACompensatedRun) {
  EXPECT_THAT(violations_of(check_shaped(good_)), HasSubstr("shaper is on in a compensated run"));
}

// Nobody has told of a shaper, so any macro may have switched one on.
TEST_F(Shaped, MustBeOffAgainBehindAMacro) {
  const std::string print = std::string(kPrint) + "T1\n" + kPrint;
  const std::string output = PlainEmitter().emit(print);
  const std::string off = "SET_INPUT_SHAPER SHAPER_FREQ_X=0 SHAPER_FREQ_Y=0\n";
  Rules rules = on_a_bed();
  rules.interpreter.shaper_unknown.x = rules.interpreter.shaper_unknown.y = true;
  const auto with_off = [&](bool behind_macro) {
    std::string text = output;
    text.insert(text.find(";unflex run\n"), off);
    if (behind_macro) {
      text.insert(text.find(";unflex run\n", text.find("T1\n")), off);
    }
    return violations_of(verify_text(print, text, rules));
  };
  EXPECT_THAT(with_off(false), HasSubstr("shaper is on in a compensated run"));
  EXPECT_EQ(with_off(true), "");
}

TEST_F(Shaped, MustBeBackOnBeforeAMacro) {
  EXPECT_EQ(violations_of(check_shaped(shaped("SET_INPUT_SHAPER SHAPER_FREQ_X=45\n"))), "");
  EXPECT_THAT(violations_of(check_shaped(shaped(""))), HasSubstr("input shaper is not restored"));
  EXPECT_THAT(violations_of(check_shaped(shaped("SET_INPUT_SHAPER SHAPER_FREQ_X=44\n"))),
              HasSubstr("input shaper is not restored"));
}

TEST(Verify, AShaperCommandOfTheSlicedFileIsKept) {
  const std::string input =
      replaced(kPrint, "M106 S128\n", "SET_INPUT_SHAPER DAMPING_RATIO_X=0.1\n");
  const std::string output = PlainEmitter().emit(input);
  EXPECT_EQ(violations_of(verify_text(input, input)), "");
  EXPECT_EQ(violations_of(verify_text(input, output)), "");
  EXPECT_EQ(verify_text(input, output).runs, 4U);
  EXPECT_THAT(violations_of(verify_text(
                  input, replaced(output, "SET_INPUT_SHAPER DAMPING_RATIO_X=0.1\n", ""))),
              HasSubstr("structure differs"));
}

TEST(Verify, LimitsOfTheSlicedFileMayLookLikeAddedOnes) {
  const std::string input = replaced(kPrint, "M106 S128\n", "SET_VELOCITY_LIMIT ACCEL=2500\nM83\n");
  const std::string output = PlainEmitter().emit(input);
  EXPECT_EQ(violations_of(verify_text(input, output)), "");
  EXPECT_THAT(
      violations_of(verify_text(input, replaced(output, "SET_VELOCITY_LIMIT ACCEL=2500\n", ""))),
      HasSubstr("in.gcode:13: line 'SET_VELOCITY_LIMIT ACCEL=2500' is lost"));
}

TEST(Verify, AnInputWithoutFinalLineEndingMayGetOne) {
  EXPECT_EQ(violations_of(verify_text("G90\n; end", "G90\n; end\n;unflex\n")), "");
  EXPECT_NE(violations_of(verify_text("G90\n; end\n", "G90\n; end")), "");
}

// If filament was rounded to five digits, a line that repeats the last E moves filament by the
// rounding error.
TEST(Verify, ALineThatMovesByRoundingAloneIsNoSectionOfItsOwn) {
  const std::string start = "G90\nM82\nG92 E0\nG1 Z0.3 F600\nG1 X20 Y20 F6000\n";
  const std::string input = start + "G1 E1.00000 F1800\nG1 Z0.5\nG1 X20 Y20 E1.00001\nG1 Z0.7\n";
  EXPECT_EQ(violations_of(verify_text(input, input)), "");
  EXPECT_EQ(verify_text(input, input).measured.compensated.time_s,
            verify_text(input, input).measured.uncompensated.time_s);
}

TEST(Verify, AMoveOfMoreThanAnHourIsAnInputError) {
  std::istringstream input("G90\nG1 Z1 F600\nG1 X1 Y1 F6000\nG1 X100 F0.001\n");
  std::istringstream output(input.str());
  SilentProgress progress;
  const auto report = verify(input, "in.gcode", output, "out.gcode", Rules{}, progress);
  ASSERT_FALSE(report.has_value());
  EXPECT_EQ(report.error().kind, ErrorKind::input);
  EXPECT_EQ(report.error().place.line, 4U);
}

TEST(Verify, KeepsAHundredViolationsAndCountsAll) {
  std::string input;
  for (int i = 0; i < 150; ++i) {
    input += fmt::format("; {}\n", i);
  }
  const VerifyReport report = verify_text(input, "");
  EXPECT_EQ(report.violations.size(), 100U);
  EXPECT_EQ(report.violation_count, 150U);
}

TEST(Verify, AFileThatIsNoTextIsAnInputError) {
  std::istringstream input("G90\nG1 X1\n");
  std::istringstream output(std::string("G90\nG1 X1\n\0binary\n", 18));
  SilentProgress progress;
  const auto report = verify(input, "in.gcode", output, "out.gcode", Rules{}, progress);
  ASSERT_FALSE(report.has_value());
  EXPECT_EQ(report.error().kind, ErrorKind::input);
  EXPECT_EQ(report.error().place.file, "out.gcode");
}

class Impatient final : public Progress {
 public:
  void update(std::string_view, double fraction) override { fraction_ = fraction; }
  [[nodiscard]] bool cancelled() const override { return fraction_ > 0.3; }
  double fraction_ = 0.0;
};

TEST(Verify, StopsWhenCancelled) {
  std::string text = "G90\nG1 Z1 F600\nG1 X1 Y1 F6000\n";
  for (int i = 0; i < 20000; ++i) {
    text += fmt::format("G1 X{} Y{}\n", 10 + i % 7, 10 + i % 5);
  }
  std::istringstream input(text);
  std::istringstream output(text);
  Impatient progress;
  EXPECT_FALSE(verify(input, "a", output, "b", Rules{}, progress).has_value());
  EXPECT_LT(progress.fraction_, 0.9);
}

// The printer's own pressure advance matters where filament is laid outside of a run.
TEST(PressureAdvance, IsToBeAsSlicedWhereFilamentIsLaid) {
  Rules rules;
  rules.fixed.pressure_advance_s = 0.04;
  const std::string head = "G28\nG90\nM83\nG1 X10 Y10 Z0.2 F6000\n";
  const std::string off = "SET_PRESSURE_ADVANCE ADVANCE=0\n";
  const std::string on = "SET_PRESSURE_ADVANCE ADVANCE=0.04\n";
  const std::string travel = "G1 X50\n";
  const std::string line = "G1 X60 E1\nG1 X70 E1\n";
  const auto violations = [&](const std::string& output) {
    return testing::violations_of(testing::verify_text(head + travel + line, head + output, rules));
  };
  EXPECT_EQ(violations(travel + line), "");
  EXPECT_EQ(violations(off + travel + on + line), "");
  EXPECT_EQ(violations(off + travel + line + on),
            "out.gcode:7: the printer's pressure advance is not restored\n");
  EXPECT_EQ(violations(travel + line + off),
            "out.gcode:8: the printer's pressure advance is not restored\n");
}

// 250 g on a bed of 500 g: 38 Hz become 31.03.
TEST(AMachineThatChanges, SwingsSlowerByTheRootOfItsMass) {
  const MachineChange change{{{}, {500.0, {}}}, 3e-3};
  EXPECT_TRUE(change.acts());
  EXPECT_DOUBLE_EQ(change.frequency_shares({}).y, 1.0);
  EXPECT_NEAR(38.0 * change.frequency_shares({0.0, 0.0, 0.0, 250.0 / 3e-3}).y, 31.0269, 1e-4);
  EXPECT_EQ(change.frequency_shares({0.0, 0.0, 0.0, 250.0 / 3e-3}).x, 1.0);
  EXPECT_EQ(change.frequency_shares({0.0, 0.0, 0.0, -5.0}).y, 1.0) << "filament drawn back";
  EXPECT_FALSE(MachineChange{}.acts());
}

TEST(AMachineThatChanges, MultipliesItsMapsAlongEachDirection) {
  MachineChange change;
  change.axes.y.maps = {{gcode::X, {0.0, 100.0}, {1.0, 0.8}}, {gcode::Y, {0.0, 100.0}, {1.0, 1.5}}};
  EXPECT_TRUE(change.acts_over_bed());
  EXPECT_NEAR(change.frequency_shares({50.0, 100.0, 3.0, 0.0}).y, 0.9 * 1.5, 1e-15);
  EXPECT_EQ(change.frequency_shares({50.0, 100.0, 3.0, 0.0}).x, 1.0);
  change.axes.y.maps = {{gcode::Z, {0.0, 100.0}, {1.0, 0.8}}};
  EXPECT_FALSE(change.acts_over_bed());
}

TEST(AMachineThatChanges, FollowsItsHeightsFromPointToPoint) {
  const MachineChange change{{{0.0, {{gcode::Z, {10.0, 20.0, 60.0}, {1.0, 0.9, 0.5}}}}, {}}, 0.0};
  EXPECT_TRUE(change.acts());
  const auto share = [&](double z_mm) { return change.frequency_shares({0.0, 0.0, z_mm, 0.0}).x; };
  EXPECT_DOUBLE_EQ(share(0.0), 1.0);
  EXPECT_DOUBLE_EQ(share(10.0), 1.0);
  EXPECT_DOUBLE_EQ(share(15.0), 0.95);
  EXPECT_DOUBLE_EQ(share(20.0), 0.9);
  EXPECT_DOUBLE_EQ(share(40.0), 0.7);
  EXPECT_DOUBLE_EQ(share(60.0), 0.5);
  EXPECT_DOUBLE_EQ(share(900.0), 0.5);
}

}  // namespace
}  // namespace unflex::verify
