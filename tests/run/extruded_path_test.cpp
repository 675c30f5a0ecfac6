// How much of a print is compensated although it has unknown commands.
#include "unflex/run/extruded_path.hpp"

#include <fmt/core.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include "jobs.hpp"
#include "unflex/core/progress.hpp"

namespace unflex::run {
namespace {

using flow::testing::JobFolder;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr double kSide_mm = 30.0;

// Squares, each after a macro, with a code of another printer before two of its sides. Z is named
// only once and lies on no grid.
std::string squares(int count) {
  std::string text = "G28\nG90\nM83\nG1 Z0.30004 F600\nG1 X40 Y40 F6000\n";
  for (int i = 0; i < count; ++i) {
    text +=
        "MY_LAYER_MACRO A=1\nG1 X50 Y50 F6000\nM971 S11 C11 O0\nG1 X80 Y50 E1 F3600\n"
        "G1 X80 Y80 E1\nM202 X1000\nG1 X50 Y80 E1\nG1 X50 Y50 E1\nG1 X40 Y40 F6000\n";
  }
  return text;
}

class OfAnyFirmware : public ::testing::TestWithParam<const char*> {
 protected:
  [[nodiscard]] static std::vector<std::string> overrides() {
    return {fmt::format("printer.firmware={}", GetParam())};
  }
};

TEST_P(OfAnyFirmware, AMacroCostsTheMoveBehindItAlone) {
  constexpr int kSquares = 3;
  const JobFolder folder(squares(kSquares), overrides());
  SilentProgress progress;
  const auto report = compensate(folder.job(), progress);
  ASSERT_TRUE(report) << to_string(report.error());
  EXPECT_EQ(report->violation_count, 0U) << flow::testing::complaints(*report);
  EXPECT_DOUBLE_EQ(report->extruded_path.total_mm, kSquares * 4 * kSide_mm);
  EXPECT_EQ(report->extruded_path.compensated_share(), 1.0);
  EXPECT_THAT(report->extruded_path.kept_mm, IsEmpty());
  ASSERT_EQ(report->unknown_commands.size(), 1U);
  const report::UnknownCommand& macro = report->unknown_commands.front();
  EXPECT_EQ(macro.command, "MY_LAYER_MACRO");
  EXPECT_EQ(macro.count, static_cast<std::size_t>(kSquares));
  EXPECT_EQ(macro.first_line, 6U);
  EXPECT_EQ(macro.moves_kept, static_cast<std::size_t>(kSquares));
  EXPECT_EQ(macro.kept_mm, 0.0);

  const auto verified = flow::verify(folder.job(), progress);
  ASSERT_TRUE(verified) << to_string(verified.error());
  EXPECT_EQ(verified->violation_count, 0U) << flow::testing::complaints(*verified);
}

// A macro may have moved to another height. Writing a Z from before the macro would undo that.
TEST_P(OfAnyFirmware, NoHeightIsWrittenThatNobodyKnows) {
  const JobFolder folder(squares(2), overrides());
  SilentProgress progress;
  const auto report = compensate(folder.job(), progress);
  ASSERT_TRUE(report) << to_string(report.error());
  ASSERT_EQ(report->runs.compensated, 2U);
  std::istringstream output(folder.output());
  bool behind_macro = false;
  std::size_t lines = 0;
  for (std::string line; std::getline(output, line);) {
    behind_macro = behind_macro || line.starts_with("MY_LAYER_MACRO");
    if (behind_macro && line.starts_with("G1 ")) {
      EXPECT_EQ(line.find('Z'), std::string::npos) << line;
      ++lines;
    }
  }
  EXPECT_GT(lines, 20U);
}

INSTANTIATE_TEST_SUITE_P(Firmwares, OfAnyFirmware, ::testing::Values("klipper", "marlin", "rrf"));

TEST(UnknownCommands, AreWarnedOfWhereTheyCostExtrudedPath) {
  const JobFolder folder(
      "G28\nG90\nM83\nG1 X50 Y50 Z0.3 F6000\nG1 X80 Y50 E1 F3600\nM1234\nG1 X80 Y80 E1\n"
      "G1 X50 Y80 E1\nM1234\nG1 X50 Y60 E1\nG1 X80 Y60 E1\n");
  SilentProgress progress;
  const auto report = compensate(folder.job(), progress);
  ASSERT_TRUE(report) << to_string(report.error());
  EXPECT_DOUBLE_EQ(report->extruded_path.total_mm, 140.0);
  EXPECT_DOUBLE_EQ(report->extruded_path.compensated_mm, 90.0);
  EXPECT_DOUBLE_EQ(report->extruded_path.kept_mm.at("start unknown"), 50.0);
  EXPECT_THAT(
      report->warnings,
      ElementsAre("in.gcode:6: warning: M1234 is not known to unflex and may move the machine: 2 "
                  "times in the print, 2 moves and 50.0 mm of extruded path behind it stay as "
                  "sliced",
                  "in.gcode: warning: only 64.2 % of the extruded path is compensated (50 mm: "
                  "start unknown)"));
}

// A line of motion that is not understood draws as well.
TEST(LostMotion, IsPartOfTheExtrudedPath) {
  const JobFolder folder(
      "G28\nG90\nM83\nG1 X50 Y50 Z0.3 F6000\nG1 X150 Y50 E1 F3600\nG1 X150 Y80 U3 E1\n"
      "G1 X50 Y80 E1\nG1 X50 Y50 E1\n");
  SilentProgress progress;
  const auto report = compensate(folder.job(), progress);
  ASSERT_TRUE(report) << to_string(report.error());
  // The line behind it begins where the sliced file has been last, as far as is known.
  const double behind_mm = std::hypot(100.0, 30.0);
  EXPECT_DOUBLE_EQ(report->extruded_path.total_mm, 100.0 + 30.0 + behind_mm + 30.0);
  EXPECT_DOUBLE_EQ(report->extruded_path.kept_mm.at("line not understood"), 30.0);
  EXPECT_THAT(report->warnings,
              ::testing::Contains(::testing::HasSubstr(
                  "in.gcode:6: warning: G1 with U, which unflex does not understand here")));
}

TEST(UnknownCommands, AreCountedByInspectToo) {
  const JobFolder folder(squares(4));
  SilentProgress progress;
  const auto inspection = inspect(folder.job(), progress);
  ASSERT_TRUE(inspection) << to_string(inspection.error());
  EXPECT_EQ(inspection->extruded_path.compensated_share(), 1.0);
  ASSERT_EQ(inspection->unknown_commands.size(), 1U);
  EXPECT_EQ(inspection->unknown_commands.front().count, 4U);
}

TEST(Remarks, NameTheLargestReasons) {
  report::ExtrudedPath path{1000.0, 100.0, {{"a", 50.0}, {"b", 400.0}, {"c", 150.0}, {"d", 300.0}}};
  EXPECT_THAT(remarks(path, {}, "in.gcode"),
              ElementsAre(HasSubstr("only 10.0 % of the extruded path is compensated (400 mm: b, "
                                    "300 mm: d, 150 mm: c)")));
  path.compensated_mm = 950.0;
  EXPECT_THAT(remarks(path, {}, "in.gcode"), IsEmpty());
  EXPECT_THAT(remarks({99.0, 0.0, {{"a", 99.0}}}, {}, "in.gcode"), IsEmpty()) << "no print";
  EXPECT_THAT(remarks({}, {{"MACRO", 5, 3, 5, 0.0}}, "in.gcode"), IsEmpty());
}

}  // namespace
}  // namespace unflex::run
