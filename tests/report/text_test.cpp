#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "report/sample_report.hpp"
#include "unflex/report/format.hpp"

namespace unflex::report {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(Summary, IsExactlyThis) {
  EXPECT_EQ(
      to_text(sample_report()),
      "cube.gcode → out.gcode\n"
      "Safe?         NO, do not print it.\n"
      "              3 rules are broken, the first: out.gcode:7: outside the travel\n"
      "              Motors are asked for at most 123 mm/s and 19999 mm/s²: 2.5 times the "
      "printer's "
      "own limit of 8000 mm/s² (--set).\n"
      "              Their speed changes by at most 27.5 mm/s from line to line.\n"
      "              The travel was checked: X 0 to 250, Y 0 to 210 mm.\n"
      "              At most 890 lines come in a second; Klipper from its own storage takes 1000.\n"
      "              87.5 % of the extruded path is compensated; the rest stays as sliced, most of "
      "it "
      "because of: run left as sliced.\n"
      "Faster?       1h 00m 00s → 1h 00m 18s to print, 0 % more; the nozzle may stray 20 µm and "
      "keeps to it\n"
      "              Frequencies known to 5 % would save some 12 % more: dynamics.freq_error = "
      "0.05\n"
      "Better?       16.0 → 2.00 µm RMS at the edges of the line: 8.0 times less than now (under "
      "the printer's own input shaper, MZV 45 Hz)\n"
      "              The line's width is 6.00 → 0.50 % RMS off, 31.0 → 2.10 for 99 % of the way\n"
      "              The nozzle is 200 → 3.12 µm RMS from the path: 64 times less than now\n"
      "              150 → 6.10 if the frequencies are 5 % off\n"
      "Where worst?  12.0 µm in line 41, layer 1, at X20.0 Y-2.3\n"
      "              Now 800 µm in line 95, layer 2, Perimeter, at X20.0 Y30.0\n"
      "              Before the first layer 900 → 50.0 µm at most\n"
      "Made for      X 45 Hz, ζ 0.06 (printer.toml:7); Y 38.5 Hz, ζ 0.1 (--set); frequencies up to "
      "10 % off\n"
      "Warnings      1, the first: cube.gcode:1: warning: no G28\n"
      "\n"
      "  off path, µm    max                 p99                 RMS\n"
      "  extruding       800 → 12.5          400 → 6.25          200 → 3.12\n"
      "  all moves       1600 → 25.0         800 → 12.5          400 → 6.25\n"
      "  321 corners     120 → 15.0          110 → 2.50          60.0 → 0.50\n"
      "  edges of lines  200 → 20.0          80.0 → 6.60         16.0 → 2.00\n"
      "width         +70 → -9 % off at most, near lines 812 and 817; 9.0 → 0.1 % of the way are "
      "more than 10 % off\n"
      "              5.00 → 7.00 % RMS if the pressure is 20 % lower, 9.00 → 5.50 if it is higher; "
      "7.00 → 4.00 if the dead time is 2 ms longer\n"
      "sensitivity   12.0, 3.12, 6.10 µm RMS if frequencies are off by -10, 0, +5 %; made for "
      "±10 %\n"
      "shaper        the printer's own is on before; without it, extruding: 900 µm max, 450 p99, "
      "225 "
      "RMS\n"
      "plants        4.00 to 9.00 µm RMS if the axes are as one of 2 plants, 150 to 180 before\n"
      "band          suiting it leaves 3.00 instead of 0.50 µm RMS where the frequencies are "
      "exact\n"
      "print time    1h 00m 00s planned, 1h 00m 18s emitted (+0.50 %)\n"
      "timing        as fast as 20 µm allow: 99.9 % of the time within 18.8 µm, the nozzle at "
      "1.019 F "
      "at most\n"
      "              2 stretches of motion have no optimal timing, and a scaled one instead\n"
      "              1 stretch of motion keeps the slicer's timing\n"
      "runs          895 of 900 stretches of motion compensated, 5 stay as sliced\n"
      "              lines 10-20: no solution\n"
      "              lines 30-44: worse than the original\n"
      "              and 3 more, listed by --report\n"
      "              12 other moves stay as they are: Z move\n"
      "solver        ipopt 3.11.9, 1000 parts, 4242 iterations\n"
      "              on 8 of them Ipopt finds the same within 0.00 µm\n"
      "path          87.5 % of 8000 mm extruded are compensated\n"
      "              900.0 mm stay as they are: run left as sliced\n"
      "              100.0 mm stay as they are: start unknown\n"
      "unknown       M1234, 40×, first in line 12: 7 moves behind it stay as they are, 100.0 mm of "
      "them extruded\n"
      "              MY_MACRO, 1×, first in line 90: 0 moves behind it stay as they are, 0.0 mm of "
      "them extruded\n"
      "output        123456 lines, 4.5 MB, 890 lines/s at peak\n"
      "lines         having few costs 0.50 µm RMS, 7.50 µm at most; more than 850 per second in 2 "
      "places, "
      "the first at line 70\n"
      "filament      1234.50 mm in, 1234.75 mm out\n"
      "              at most 12.5 % less than as sliced over 10 ms, near line 813; 6.2 for 99 % of "
      "the time\n"
      "              fitted before: 100.00 mm of moves that print became 110.50, 240.5 mm³ of "
      "material\n"
      "flow          10.5 → 12.4 mm³/s at most; the hotend melts 15.0\n"
      "step rates    X 24.0 → 31.2 (line 812), E 1.2 → 1.3 kHz at most; 50.0 allowed\n"
      "temperature   +14.9 °C off its target at most while filament is laid (line 1410)\n"
      "              by more than 5 °C: 1.3 s too cold and 8.2 s too hot; as sliced 21.3 s too "
      "cold "
      "and 1.5 s too hot\n"
      "              1 change asked for ahead\n"
      "              the print waits 24 → 12 s for it\n"
      "speed         40 s of print per second, 1m 30s in all, 64 MB\n");
}

TEST(Summary, TellsHowToKnowTheLineWhereItDoesNot) {
  Report report = sample_report();
  report.measured.uncompensated.line = {};
  const std::string text = to_text(report);
  EXPECT_THAT(text, HasSubstr("\nBetter?       200 → 3.12 µm RMS from the path: 64 times less than "
                              "now (under the printer's own input shaper, MZV 45 Hz)\n"
                              "              How wide the line comes out is not known: give "
                              "pressure.advance_s, the pressure advance that the hotend needs; "
                              "unflex tune --pressure finds it by printing\n"));
  EXPECT_THAT(text, HasSubstr("laid 60.0 → 4.50 µm RMS ahead of the nozzle or behind"));
  EXPECT_THAT(text, Not(HasSubstr("edges")));
}

TEST(Summary, ComparesWithZvWhereThePrinterHasNoShaper) {
  Report report = sample_report();
  report.measured.unshaped = std::nullopt;
  report.facts.shaper.clear();
  report.violations.clear();
  report.violation_count = 0;
  const std::string text = to_text(report);
  EXPECT_THAT(text, HasSubstr("\nBetter?       16.0 → 2.00 µm RMS at the edges of the line: "
                              "8.0 times less than now (without an input shaper)\n"));
  EXPECT_THAT(text, HasSubstr("A ZV shaper would leave 4.00 µm, 9.00 if they are 5 % off\n"));
  EXPECT_THAT(text, HasSubstr("Safe?         Yes, every rule is kept.\n"));
}

TEST(Summary, SaysWhereThePrintIsWorseThanNow) {
  Report report = sample_report();
  report.free_timing = {};
  report.measured.compensated.extruding.contour_rms_mm = 0.5;
  EXPECT_THAT(to_text(report), HasSubstr("2.5 times MORE than now"));
  report.measured.compensated = report.measured.uncompensated;
  EXPECT_THAT(to_text(report), HasSubstr("as much as now"));
}

// A print that is as fast as a tolerance allows may stray more than now.
TEST(Summary, SaysWhereCompensationIsHardlyWorthIt) {
  Report report = sample_report();
  report.free_timing.tolerance_mm = 0.0;
  EXPECT_THAT(to_text(report), ::testing::Not(HasSubstr("Hardly worth it")));
  report.measured.uncompensated.extruding.contour_p99_mm = 0.0079;
  EXPECT_THAT(to_text(report), HasSubstr("Hardly worth it: as sliced 99 % of the time are within "
                                         "7.90 µm, and an eye sees 8\n"));
  EXPECT_THAT(to_html(report), HasSubstr("Hardly worth it"));
  // A faster print is worth it for its time.
  report.free_timing.tolerance_mm = 0.02;
  EXPECT_THAT(to_text(report), ::testing::Not(HasSubstr("Hardly worth it")));
}

TEST(Summary, SaysThatStrayingInTravelIsHarmless) {
  Report report = sample_report();
  report.measured.uncompensated.all.contour_max_mm = 0.02;
  report.measured.compensated.all.contour_max_mm = 0.15;
  EXPECT_THAT(to_text(report), HasSubstr("20.0 → 150"));
  EXPECT_THAT(to_text(report),
              HasSubstr("(in travel, where nothing is laid, straying is harmless)"));
}

TEST(Summary, OfAFasterPrintBeginsWithItsTimeAndNamesNoLoss) {
  Report report = sample_report();
  report.measured.compensated.extruding.contour_rms_mm = 0.5;
  report.free_timing.tolerance_mm = 0.02;
  report.measured.compensated.extruding.contour_p999_mm = 0.0195;
  report.measured.uncompensated.time_s = 100.0;
  report.measured.compensated.time_s = 80.0;
  report.free_timing.narrower = NarrowerBand{0.05, 1.0};  // too little to be told
  std::string text = to_text(report);
  EXPECT_THAT(text, HasSubstr("Faster?       1m 40s → 1m 20s to print, 20 % less; the nozzle may "
                              "stray 20 µm and keeps to it\nBetter?       "));
  EXPECT_THAT(text, ::testing::Not(HasSubstr("MORE than now")));
  report.measured.compensated.extruding.contour_p999_mm = 0.03;
  EXPECT_THAT(to_text(report), HasSubstr("may stray 20 µm and strays further in places\n"));
}

TEST(Summary, SaysWhereMotorsKeepThePrintersOwnLimits) {
  Report report = sample_report();
  report.facts.motor_max_accel_mm_s2 = 20000.0;
  report.facts.travel.clear();
  EXPECT_THAT(to_text(report),
              HasSubstr("19999 mm/s², within the printer's own limit of 20000 mm/s²"));
  EXPECT_THAT(to_text(report), HasSubstr("travel is not known and not checked"));
  report.facts.motor_max_velocity_mm_s = 100.0;
  EXPECT_THAT(to_text(report), HasSubstr("and above its 100 mm/s"));
}

TEST(Summary, DoesNotSpeakOfRunsWhereNothingWasSolved) {
  Report report = sample_report();
  report.command = "verify";
  report.runs.total = 0;
  report.runs.windows_total = 0;
  report.solver.engine.clear();
  EXPECT_THAT(to_text(report), Not(HasSubstr("solver")));
  EXPECT_THAT(to_text(report), Not(HasSubstr("per second in")));
}

TEST(Summary, SpeaksOfNoBandWhereTheFrequenciesAreExact) {
  Report report = sample_report();
  report.others.freq_error = 0.0;
  EXPECT_THAT(to_text(report), HasSubstr("are off by -10, 0, +5 %\n"));
}

TEST(Summary, DoesNotSpeakOfCornersWhereThereAreNone) {
  Report report = sample_report();
  report.measured.uncompensated.corners = report.measured.compensated.corners = {};
  EXPECT_THAT(to_text(report), Not(HasSubstr("corners")));
}

TEST(Summary, SaysWhetherTheFilamentComesFasterThanAsSliced) {
  Report report = sample_report();
  report.measured.flow_difference->relative = 0.031;
  EXPECT_THAT(to_text(report), HasSubstr("at most 3.1 % more than as sliced over 10 ms, near "));
  report.measured.flow_difference = std::nullopt;
  EXPECT_THAT(to_text(report), Not(HasSubstr("as sliced over")));
}

TEST(Summary, SpeaksOfTheFlowOnlyWhereItRisesOrIsLimited) {
  Report report = sample_report();
  report.max_flow_mm3_s = std::nullopt;
  EXPECT_THAT(to_text(report), HasSubstr("flow          10.5 → 12.4 mm³/s at most\n"));
  report.measured.compensated.flow.max_mm3_s = 10.7;
  EXPECT_THAT(to_text(report), Not(HasSubstr("flow")));
  report.max_flow_mm3_s = 15.0;
  EXPECT_THAT(to_text(report),
              HasSubstr("flow          10.5 → 10.7 mm³/s at most; the hotend melts 15.0\n"));
}

TEST(Summary, IsSilentAboutStepRatesWhereNoStepsAreKnown) {
  Report report = sample_report();
  report.step_rates.motors.clear();
  EXPECT_THAT(to_text(report), Not(HasSubstr("step rates")));
}

TEST(Summary, TellsOfTheTemperatureWhatIsKnown) {
  Report report = sample_report();
  report.temperature->sliced = {0.0, 0.0, -0.4, 17, 0.0};
  report.temperature->emitted = {0.0, 0.0, 0.3, 18, 0.0};
  report.temperature->ahead.clear();
  EXPECT_THAT(
      to_text(report),
      HasSubstr("temperature   +0.3 °C off its target at most while filament is laid (line 18), "
                "always within 5\n"));
  report.temperature->is_known = false;
  EXPECT_THAT(to_text(report), HasSubstr("temperature   not known, since no line"));
  report.temperature = std::nullopt;
  EXPECT_THAT(to_text(report), Not(HasSubstr("temperature")));
}

TEST(Summary, SaysThatTheBudgetOfLinesHolds) {
  Report report = sample_report();
  report.line_budget.places_above = 0;
  EXPECT_THAT(to_text(report), HasSubstr("7.50 µm at most; never more than 850 per second\n"));
}

TEST(Summary, NamesAFewUnknownCommandsAndCountsTheRest) {
  EXPECT_EQ(unknown_text({}), "");
  const std::string text = unknown_text(std::vector<UnknownCommand>(8, {"MACRO", 2, 3, 0, 0.0}));
  EXPECT_EQ(std::ranges::count(text, '\n'), 6);
  EXPECT_THAT(text, ::testing::EndsWith("and 3 more, listed by --report\n"));
}

TEST(Shares, AreWholeOnlyWhereNothingIsLeft) {
  EXPECT_EQ(share_text(1.0), "100.0 %");
  EXPECT_EQ(share_text(0.99999), "99.9 %");
  EXPECT_EQ(share_text(0.5), "50.0 %");
  EXPECT_EQ(share_text(0.0), "0.0 %");
  EXPECT_EQ(ExtrudedPath{}.compensated_share(), 1.0);
}

TEST(Summary, OfAnEmptyPrintHasNoInfinities) {
  const std::string text = to_text(Report{});
  EXPECT_THAT(text, HasSubstr("0.0s planned, 0.0s emitted (+0.00 %)"));
  EXPECT_THAT(text, Not(HasSubstr("nan")));
  EXPECT_THAT(text, Not(HasSubstr("inf")));
}

TEST(Durations, AreReadable) {
  EXPECT_EQ(duration_text(0.0), "0.0s");
  EXPECT_EQ(duration_text(5.25), "5.2s");
  EXPECT_EQ(duration_text(59.94), "59.9s");
  EXPECT_EQ(duration_text(59.97), "1m 00s");
  EXPECT_EQ(duration_text(60.0), "1m 00s");
  EXPECT_EQ(duration_text(3599.6), "1h 00m 00s");
  EXPECT_EQ(duration_text(3725.4), "1h 02m 05s");
}

TEST(SettingText, HasReadableNumbersAndLeavesTextsAlone) {
  EXPECT_EQ(setting_text("583.3333333333334"), "583.33");
  EXPECT_EQ(setting_text("[-4.512345678, 235]"), "[-4.5123, 235]");
  EXPECT_EQ(setting_text("[{freq_hz = 45.123456789, damping_ratio = 0.05, gain = -0.2}]"),
            "[{freq_hz = 45.123, damping_ratio = 0.05, gain = -0.2}]");
  EXPECT_EQ(setting_text("\"v0.13.0-700, 3.123456789\""), "\"v0.13.0-700, 3.123456789\"");
  EXPECT_EQ(setting_text("true"), "true");
  EXPECT_EQ(setting_text(""), "");
}

}  // namespace
}  // namespace unflex::report
