// The hotend along a print, and changes of its temperature asked for ahead.
#include "unflex/temperature/temperature.hpp"

#include <fmt/core.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "jobs.hpp"
#include "lines_ahead.hpp"
#include "paths.hpp"
#include "print_course.hpp"

namespace unflex::flow {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::JobFolder;

// The reference of tests/hotend, and the axes.
std::vector<std::string> with_model(Firmware firmware, const std::vector<std::string>& more = {}) {
  std::vector<std::string> overrides = {fmt::format("printer.firmware={}", to_string(firmware)),
                                        "dynamics.freq_error=0",
                                        "hotend.gain_c=2",
                                        "hotend.time_constant_s=300",
                                        "hotend.sensor_lag_s=2.5",
                                        "hotend.dead_time_s=5"};
  overrides.insert(overrides.end(), more.begin(), more.end());
  return overrides;
}

std::string data(const std::string& name) {
  return testing::read_file(std::string(test_paths::kData) + "/" + name);
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) {
    lines.push_back(line);
  }
  return lines;
}

std::string without_changes(const std::string& text) {
  std::string rest;
  for (const std::string& line : lines_of(text)) {
    rest += line.starts_with("M104") ? "" : line + "\n";
  }
  return rest;
}

// A print of 80 s at 210 °C, with three changes in it.
std::string print_with_changes() {
  const std::vector<std::string> lines = lines_of(data("pipeline_textplate.gcode"));
  std::string text;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    text += i == 300 ? "M104 S225\n" : i == 550 ? "M104 S240 ; second\n" : "";
    text += i == 750 ? "M104 S228\n" : "";
    text += lines[i] + "\n";
  }
  return text;
}

Result<report::Report> compensated(const JobFolder& folder) {
  SilentProgress progress;
  return compensate(folder.job(2), progress);
}

Result<report::Report> verified(const JobFolder& folder) {
  SilentProgress progress;
  return verify(folder.job(), progress);
}

double out_of_band_s(const report::TemperatureRow& row) { return row.colder_s + row.hotter_s; }

class OfFirmware : public ::testing::TestWithParam<Firmware> {};

TEST_P(OfFirmware, ChangesAheadLeaveEveryOtherByteAndTheTime) {
  const std::string print = print_with_changes();
  const JobFolder late(print, with_model(GetParam()));
  const Result<report::Report> before = compensated(late);
  ASSERT_TRUE(before) << to_string(before.error());
  ASSERT_TRUE(before->temperature.has_value());
  EXPECT_TRUE(before->temperature->is_known);
  EXPECT_THAT(before->temperature->ahead, IsEmpty());
  EXPECT_GT(before->temperature->emitted.colder_s, 10.0);
  EXPECT_NEAR(out_of_band_s(before->temperature->emitted),
              out_of_band_s(before->temperature->sliced), 1.0);
  for (const std::string when : {"heating", "both"}) {
    SCOPED_TRACE(when);
    const JobFolder early(
        print, with_model(GetParam(), {"hotend.ahead=true", "hotend.ahead_when=" + when}));
    const Result<report::Report> after = compensated(early);
    ASSERT_TRUE(after) << to_string(after.error());
    EXPECT_THAT(testing::complaints(*after), IsEmpty());
    EXPECT_EQ(after->measured.compensated.time_s, before->measured.compensated.time_s);
    EXPECT_NE(early.output(), late.output());
    EXPECT_EQ(without_changes(early.output()), without_changes(late.output()));
    const report::Temperature& t = *after->temperature;
    EXPECT_EQ(t.ahead.size(), when == "both" ? 3U : 2U);
    EXPECT_EQ(t.ahead[0].line, 301U);
    EXPECT_EQ(t.ahead[0].to_c, 225.0);
    EXPECT_LT(t.emitted.colder_s, 0.5 * before->temperature->emitted.colder_s);
    EXPECT_LE(out_of_band_s(t.emitted), out_of_band_s(before->temperature->emitted) + 0.2);
    const Result<report::Report> again = verified(early);
    ASSERT_TRUE(again) << to_string(again.error());
    EXPECT_EQ(again->violation_count, 0U) << testing::complaints(*again);
    EXPECT_EQ(again->temperature->emitted.colder_s, t.emitted.colder_s);
    EXPECT_EQ(again->temperature->emitted.hotter_s, t.emitted.hotter_s);
    EXPECT_EQ(again->temperature->emitted.worst_line, t.emitted.worst_line);
    EXPECT_EQ(again->measured.compensated.flow.max_line, after->measured.compensated.flow.max_line);
    EXPECT_EQ(again->measured.output.lines, after->measured.output.lines);
  }
}

TEST_P(OfFirmware, WaitsLessForWhatIsAskedAhead) {
  std::string print = print_with_changes();
  print.replace(print.find("M104 S225"), 4, "M109");
  const JobFolder late(print, with_model(GetParam()));
  const JobFolder early(print, with_model(GetParam(), {"hotend.ahead=true"}));
  const Result<report::Report> before = compensated(late);
  const Result<report::Report> after = compensated(early);
  ASSERT_TRUE(before && after);
  EXPECT_THAT(testing::complaints(*after), IsEmpty());
  EXPECT_LT(after->temperature->emitted.waiting_s, before->temperature->emitted.waiting_s - 6.0);
  EXPECT_THAT(early.output(), HasSubstr("M109 S225\n"));
  EXPECT_EQ(early.output().find("M104 S225\n"), early.output().rfind("M104 S225\n"));
  EXPECT_LT(early.output().find("M104 S225\n"), early.output().find("M109 S225\n"));
  EXPECT_EQ(without_changes(early.output()), without_changes(late.output()));
  const Result<report::Report> again = verified(early);
  ASSERT_TRUE(again) << to_string(again.error());
  EXPECT_EQ(again->violation_count, 0U) << testing::complaints(*again);
  EXPECT_EQ(again->measured.output.lines, after->measured.output.lines);
}

INSTANTIATE_TEST_SUITE_P(Temperature, OfFirmware,
                         ::testing::Values(Firmware::klipper, Firmware::marlin, Firmware::rrf),
                         [](const auto& one) { return std::string(to_string(one.param)); });

TEST(Temperature, IsToldOnlyWithAModel) {
  const JobFolder folder(print_with_changes());
  const Result<report::Report> report = compensated(folder);
  ASSERT_TRUE(report);
  EXPECT_FALSE(report->temperature.has_value());
}

TEST(Temperature, IsNotKnownWhereNothingSetsIt) {
  const JobFolder folder("G28\nG90\nM83\nG1 X10 Y10 Z0.2 F6000\nG1 X60 E1 F3000\nM104 S0\n",
                         with_model(Firmware::klipper));
  const Result<report::Report> report = compensated(folder);
  ASSERT_TRUE(report);
  ASSERT_TRUE(report->temperature.has_value());
  EXPECT_FALSE(report->temperature->is_known);
}

// What verify says of an output in which a change was put ahead by hand.
// What a wipe draws back hides how much filament has been laid since.
TEST_P(OfFirmware, ChangesAheadMayPassAWipe) {
  std::string print = "G28\nG90\nM83\nM109 S200\nG1 X10 Y10 Z0.2 F6000\n";
  for (int i = 0; i < 60; ++i) {
    print += fmt::format("G1 X{} Y{} E0.002 F1200\n", i % 2 == 0 ? 30 : 10, 10 + i % 3);
  }
  print += "G1 X20 E-0.8 F3000\nG1 X25 E0.01 F1200\nM104 S220\n";
  for (int i = 0; i < 30; ++i) {
    print += fmt::format("G1 X{} E0.002 F1200\n", i % 2 == 0 ? 50 : 25);
  }
  print += "M104 S0\nM84\n";
  const JobFolder folder(print, with_model(GetParam(), {"hotend.ahead=true"}));
  const Result<report::Report> report = compensated(folder);
  ASSERT_TRUE(report) << to_string(report.error());
  ASSERT_EQ(report->temperature->ahead.size(), 1U);
  const Result<report::Report> again = verified(folder);
  ASSERT_TRUE(again) << to_string(again.error());
  EXPECT_EQ(again->violation_count, 0U) << testing::complaints(*again);
}

class AskedAhead : public ::testing::Test {
 protected:
  static std::string print(const std::string& between) {
    std::string text = "G28\nG90\nM83\nM109 S200\nG1 X10 Y10 Z0.2 F6000\n";
    for (int i = 0; i < 20; ++i) {
      text += fmt::format("G1 X{} E1 F3000\n", i % 2 == 0 ? 60 : 10);
      text += i == 10 ? between : "";
    }
    return text + "M104 S0\nM84\n";
  }

  // The sliced file with the line taken out, if it is there, and put behind the first move.
  static std::string violations(const std::string& sliced, const std::string& ahead, bool takes_out,
                                const std::string& allowed = "true") {
    const JobFolder folder(sliced, with_model(Firmware::klipper, {"hotend.ahead=" + allowed}));
    std::string output = sliced;
    if (takes_out) {
      output.erase(output.find(ahead), ahead.size());
    }
    output.insert(output.find("G1 X60 E1") + sizeof("G1 X60 E1 F3000"), ahead);
    folder.set_output(output);
    const Result<report::Report> report = verified(folder);
    EXPECT_TRUE(report) << to_string(report.error());
    return testing::complaints(*report);
  }
};

TEST_F(AskedAhead, IsNoViolation) {
  EXPECT_EQ(violations(print("M104 S220\n"), "M104 S220\n", true), "");
  EXPECT_EQ(violations(print("M106 S80\nM104 S220\n;a comment\n"), "M104 S220\n", true), "");
  EXPECT_EQ(violations(print("M109 S220\n"), "M104 S220\n", false), "");
  EXPECT_EQ(violations(print("M109 S220.125\n"), "M104 S220.13\n", false), "");
  EXPECT_EQ(violations(print("SET_HEATER_TEMPERATURE HEATER=extruder TARGET=220\n"),
                       "SET_HEATER_TEMPERATURE HEATER=extruder TARGET=220\n", true),
            "");
}

// A round of one run, in which no other line stands between the two places.
TEST(AskedAheadInARun, IsNoViolationUnlessItComesLate) {
  std::string print = "G28\nG90\nM83\nM109 S200\nG1 X120 Y100 Z0.2 F6000\n";
  for (int i = 1; i <= 800; ++i) {
    const double angle = 0.12 * i;
    print += fmt::format("G1 X{:.3f} Y{:.3f} E0.05 F1800\n", 100.0 + 20.0 * std::cos(angle),
                         100.0 + 20.0 * std::sin(angle));
    print += i == 450 ? "M104 S220\n" : "";
  }
  print += "M104 S0\n";
  const JobFolder early(print, with_model(Firmware::klipper, {"hotend.ahead=true"}));
  const Result<report::Report> made = compensated(early);
  ASSERT_TRUE(made) << to_string(made.error());
  ASSERT_EQ(made->temperature->ahead.size(), 1U);
  const Result<report::Report> checked = verified(early);
  ASSERT_TRUE(checked) << to_string(checked.error());
  EXPECT_EQ(testing::complaints(*checked), "");
  std::string late = early.output();
  const std::string change = "M104 S220\n";
  late.erase(late.find(change), change.size());
  late.insert(late.rfind("\nG1", late.size() - 400) + 1, change);
  early.set_output(late);
  const Result<report::Report> spoilt = verified(early);
  ASSERT_TRUE(spoilt) << to_string(spoilt.error());
  EXPECT_THAT(testing::complaints(*spoilt), HasSubstr("'M104 S220' moved along the path by"));
}

TEST_F(AskedAhead, MustBeAllowed) {
  EXPECT_THAT(violations(print("M104 S220\n"), "M104 S220\n", true, "false"),
              HasSubstr("lost or changed"));
}

TEST_F(AskedAhead, MustBeWhatIsAskedForNext) {
  const auto is_found = HasSubstr("asks for a temperature that is not the next one");
  EXPECT_THAT(violations(print("M104 S220\n"), "M104 S220\n", false), is_found) << "twice";
  EXPECT_THAT(violations(print("M104 S220\n"), "M104 S260\n", false), is_found);
  EXPECT_THAT(violations(print("M109 S220\n"), "M104 S260\n", false), is_found);
  EXPECT_THAT(violations(print("M104 S210\nM104 S220\n"), "M104 S220\n", true), is_found);
  EXPECT_THAT(violations(print(""), "M104 S220\n", false), is_found);
  EXPECT_THAT(violations(print("T1\nM104 S220\n"), "M104 S220\n", true), is_found);
  EXPECT_THAT(violations(print("PAUSE\nM104 S220\n"), "M104 S220\n", true), is_found);
  EXPECT_THAT(violations(print("MY_MACRO\nM104 S220\n"), "M104 S220\n", true), is_found);
}

TEST_F(AskedAhead, MustNotWaitOrSwitchOff) {
  EXPECT_THAT(violations(print("M109 S220\n"), "M109 S220\n", true), HasSubstr("lost or changed"));
  EXPECT_THAT(violations(print("M104 S0\n"), "M104 S0\n", true), HasSubstr("lost or changed"));
}

temperature::PrintCourse course_of(const std::string& text, Firmware firmware) {
  SilentProgress progress;
  return temperature::print_course(*memory_store(text), "in.gcode",
                                   testing::settings(with_model(firmware)), progress)
      .value();
}

// When commands come and from when on nothing stands in their way.
std::string commands_of(const std::string& text, Firmware firmware = Firmware::klipper) {
  std::string all;
  for (const hotend::Command& command : course_of(text, firmware).commands) {
    all += fmt::format("{}: {}{} at {:.2f} free from {:.2f}{}\n", command.line,
                       command.target_c.value_or(-1.0),
                       command.wait == hotend::Wait::none ? "" : " waits", command.time_s,
                       command.free_from_s, command.text.empty() ? " fixed" : "");
  }
  return all;
}

// A line of 1 s, but for the ramps.
constexpr std::string_view kStart = "G28\nG90\nM83\nG1 X10 Y10 F6000\nM204 S1000000\n";

TEST(PrintCourse, KnowsWhenCommandsCome) {
  const std::string print = fmt::format(
      "{}G1 X60 E1 F3000\nM104 S210\nG1 X10 E1\nG4 P2000\nG1 X60 E1\nM104 S220\nG1 X10 E1\n",
      kStart);
  const temperature::PrintCourse course = course_of(print, Firmware::klipper);
  ASSERT_EQ(course.commands.size(), 2U);
  const hotend::Command& first = course.commands[0];
  const hotend::Command& second = course.commands[1];
  // Travel takes about 0.14 s, and each line 1 s.
  EXPECT_NEAR(second.time_s - first.time_s, 4.0, 0.05);
  EXPECT_NEAR(second.free_from_s, first.time_s, 1e-9);
  EXPECT_NEAR(first.time_s - first.free_from_s, 1.0, 0.05) << "from the first extrusion on";
  EXPECT_EQ(first.line, 7U);
  EXPECT_EQ(first.text, "M104 S210\n");
  const double area_mm2 = 2.405281875467;
  EXPECT_NEAR(first.laid_mm3, area_mm2, 1e-6);
  EXPECT_NEAR(second.laid_mm3, 3.0 * area_mm2, 1e-6);
  double laid_mm3 = 0.0;
  double extruding_s = 0.0;
  for (const hotend::Course::Step& step : course.course.steps) {
    laid_mm3 += step.volume_mm3;
    extruding_s += step.extruding_s;
  }
  EXPECT_NEAR(laid_mm3, 4.0 * area_mm2, 1e-4);
  EXPECT_NEAR(extruding_s, 4.0, 0.05);
}

// However slow a line or long a pause is, the course ends and holds all filament.
TEST(PrintCourse, LastsAnHourAtMostForEachLine) {
  const temperature::PrintCourse course = course_of(
      fmt::format("{}G1 X60 E1 F0.01\nG4 P1000000000\nG1 X10 E1 F3000\nM104 S220\n", kStart),
      Firmware::klipper);
  ASSERT_EQ(course.commands.size(), 1U);
  EXPECT_NEAR(course.commands[0].time_s, 7201.0, 1.0);
  EXPECT_NEAR(course.commands[0].laid_mm3, 2.0 * 2.405281875467, 1e-6);
}

TEST(PrintCourse, KnowsWhatStandsInTheWay) {
  const auto free_from = [](const std::string& between, Firmware firmware = Firmware::klipper) {
    const std::string print =
        fmt::format("{}G1 X60 E1 F3000\n{}G1 X10 E1\nM104 S220\nG1 X60 E1\n", kStart, between);
    const temperature::PrintCourse course = course_of(print, firmware);
    return course.commands.back().time_s - course.commands.back().free_from_s;
  };
  EXPECT_NEAR(free_from(""), 2.0, 0.05);
  for (const std::string_view harmless : {"G4 P100\n", "M400\n", "M106 S100\n", "M73 P10\n",
                                          "M104 T1 S200\n", "M140 S60\n", ";comment\n"}) {
    EXPECT_GT(free_from(std::string(harmless)), 1.9) << harmless;
  }
  for (const std::string_view obstacle :
       {"M104 S210\n", "M109 S210\n", "T1\nT0\n", "PAUSE\n", "M600\n", "MY_MACRO\n", "G28\n",
        "SET_HEATER_TEMPERATURE HEATER=extruder TARGET=1\n", "TURN_OFF_HEATERS\n"}) {
    EXPECT_NEAR(free_from(std::string(obstacle)), 1.0, 0.2) << obstacle;
  }
  EXPECT_NEAR(free_from("if true\n  M118 P0 S\"x\"\n", Firmware::rrf), 1.0, 0.2);
}

TEST(PrintCourse, LeavesLinesThatCannotStandAlone) {
  const auto text_of = [](const std::string& line, Firmware firmware) {
    return course_of(fmt::format("{}G1 X60 E1 F3000\n{}\nG1 X10 E1\n", kStart, line), firmware)
        .commands.at(0)
        .text;
  };
  EXPECT_EQ(text_of("M104 S210 ; hot", Firmware::klipper), "M104 S210 ; hot\n");
  EXPECT_EQ(text_of("M109 S210", Firmware::klipper), "M104 S210\n");
  EXPECT_EQ(text_of("M104 S210\r", Firmware::klipper), "M104 S210\r\n");
  EXPECT_EQ(text_of("M109 S210\r", Firmware::klipper), "M104 S210\r\n");
  EXPECT_EQ(text_of("N10 M104 S210", Firmware::marlin), "");
  EXPECT_EQ(text_of("  M104 S210", Firmware::rrf), "");
  EXPECT_EQ(text_of("M116", Firmware::rrf), "");
  EXPECT_EQ(text_of("G10 P0 S210 R150", Firmware::rrf), "G10 P0 S210 R150\n");
}

TEST(PrintCourse, KnowsWhatMacrosHeatTo) {
  const std::string print =
      fmt::format("START_PRINT BED=60 EXTRUDER=215\n{}G1 X60 E1 F3000\n", kStart);
  EXPECT_EQ(commands_of(print).substr(0, 13), "1: 215 waits ");
  EXPECT_EQ(commands_of("START_PRINT BED=60 EXTRUDER=2\nG28\n"), "");
}

class LinesAhead : public ::testing::Test {
 protected:
  static std::string put(const std::string& text,
                         const std::vector<temperature::LineAhead>& lines) {
    const auto store = memory_store(text);
    EXPECT_TRUE(temperature::put_ahead(*store, "out.gcode", lines));
    return {std::istreambuf_iterator<char>(*store->read()), {}};
  }
};

TEST_F(LinesAhead, StandWhereTheyShall) {
  EXPECT_EQ(put("a\nb\nc\nd\n", {{2, 4, "d\n"}}), "a\nd\nb\nc\n");
  EXPECT_EQ(put("a\nb\nc\nd", {{1, 4, "d\n"}}), "d\na\nb\nc\n");
  EXPECT_EQ(put("a\nb\nc\n", {{2, 0, "new\n"}}), "a\nnew\nb\nc\n");
  EXPECT_EQ(put("a\nb\nc\nd\ne\n", {{1, 2, "b\n"}, {3, 0, "n\n"}, {4, 5, "e\n"}}),
            "b\na\nn\nc\ne\nd\n");
  EXPECT_EQ(put("a\r\nb\r\n", {}), "a\r\nb\r\n");
}

TEST_F(LinesAhead, AreNumberedAsTheyStand) {
  std::mt19937 random(11);
  for (int round = 0; round < 30; ++round) {
    std::vector<std::string> lines;
    std::string text;
    for (int i = 0; i < 400; ++i) {
      lines.push_back(fmt::format("line {} {}\n", i, std::string(random() % 20, 'x')));
      text += lines.back();
    }
    std::vector<temperature::LineAhead> ahead;
    for (std::size_t at = 1 + random() % 40; at + 60 < lines.size();) {
      const std::size_t from = at + 1 + random() % 30;
      const bool stays = random() % 3 == 0;
      ahead.push_back({at, stays ? 0 : from, stays ? "new\n" : lines[from - 1]});
      at = from + 1 + random() % 40;
    }
    const std::vector<std::string> result = lines_of(put(text, ahead));
    const auto is_ahead = [&](std::size_t number) {
      return std::ranges::count(ahead, number, &temperature::LineAhead::from_line) > 0;
    };
    for (std::size_t number = 1; number <= lines.size(); ++number) {
      if (!is_ahead(number)) {
        ASSERT_EQ(result[temperature::number_behind(ahead, number) - 1] + "\n", lines[number - 1]);
      }
    }
  }
}

TEST_F(LinesAhead, GoThroughALargeFile) {
  std::string text;
  std::string expected;
  const std::string last = "last\n";
  for (int i = 0; i < 300'000; ++i) {
    text += "G1 X1 Y2 E3\n";
  }
  expected = last + text;
  EXPECT_TRUE(put(text + last, {{1, 300'001, last}}) == expected);
}

}  // namespace
}  // namespace unflex::flow
