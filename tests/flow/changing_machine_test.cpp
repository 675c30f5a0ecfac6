// Machines whose frequencies change while a print goes on.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "made_prints.hpp"
#include "paths.hpp"

namespace unflex::flow {
namespace {

using testing::complaints;
using testing::JobFolder;
using testing::Made;
using testing::rms_mm;

// The print lays half a gram. On a bed of as little as 2 g its frequency falls by a tenth.
const std::vector<std::string> kExact = {"dynamics.freq_error=0", "dynamics.y.freq_hz=38"};
const std::string kBed = "dynamics.y.moving_mass_g=2";

std::vector<std::string> with(std::vector<std::string> overrides,
                              const std::vector<std::string>& more) {
  overrides.insert(overrides.end(), more.begin(), more.end());
  return overrides;
}

std::string print() {
  return testing::read_file(std::filesystem::path(test_paths::kData) / "pipeline_star.gcode");
}

Made made(const std::vector<std::string>& overrides, unsigned workers = 2) {
  return testing::made(print(), overrides, workers);
}

TEST(AMovingBed, IsCompensatedForItsMassAtEachRun) {
  const Made empty = made(kExact);
  const Made loaded = made(with(kExact, {kBed}));
  EXPECT_LE(rms_mm(loaded.report), 1.3 * rms_mm(empty.report));
  // Motion for the empty bed is measured on the bed with the print.
  const JobFolder ignored(print(), with(kExact, {kBed}));
  ignored.set_output(empty.text);
  SilentProgress progress;
  const Result<report::Report> measured = verify(ignored.job(), progress);
  ASSERT_TRUE(measured) << to_string(measured.error());
  EXPECT_LE(rms_mm(loaded.report), 0.3 * rms_mm(*measured));
  EXPECT_EQ(measured->measured.uncompensated.extruding.contour_rms_mm,
            loaded.report.measured.uncompensated.extruding.contour_rms_mm);
}

TEST(AMovingBed, IsTheSameForAnyNumberOfWorkers) {
  EXPECT_EQ(made(with(kExact, {kBed}), 1).text, made(with(kExact, {kBed}), 3).text);
}

TEST(AMovingBed, OfAWholeTonStaysAsItIs) {
  EXPECT_EQ(made(with(kExact, {"dynamics.y.moving_mass_g=1e6"})).text, made(kExact).text);
}

// Holds the print made for a machine with this setting against the print that ignores it, and
// against a machine that does not change.
void expect_followed(const std::string& setting) {
  const Made constant = made(kExact);
  const Made followed = made(with(kExact, {setting}));
  EXPECT_LE(rms_mm(followed.report), 1.3 * rms_mm(constant.report)) << setting;
  const JobFolder ignored(print(), with(kExact, {setting}));
  ignored.set_output(constant.text);
  SilentProgress progress;
  const Result<report::Report> measured = verify(ignored.job(), progress);
  ASSERT_TRUE(measured) << to_string(measured.error());
  EXPECT_LE(rms_mm(followed.report), 0.3 * rms_mm(*measured)) << setting;
}

// Most of the print lies at 0.2 mm, where the frequency has fallen by a tenth.
TEST(AMapOfHeights, IsFollowedRunByRun) {
  expect_followed("dynamics.y.map=[{along = \"z\", at_mm = [0, 0.2], freq_hz = [38, 34]}]");
}

TEST(AMapOverTheBed, IsFollowedWithinRuns) {
  expect_followed("dynamics.y.map=[{along = \"x\", at_mm = [120, 210], freq_hz = [40, 34]}]");
  expect_followed("dynamics.y.map=[{along = \"y\", at_mm = [140, 210], freq_hz = [34, 40]}]");
}

TEST(AMapOverTheBed, IsTheSameForAnyNumberOfWorkers) {
  const std::string map =
      "dynamics.y.map=[{along = \"x\", at_mm = [120, 210], freq_hz = [40, 34]}]";
  EXPECT_EQ(made(with(kExact, {map}), 1).text, made(with(kExact, {map}), 3).text);
}

// The timing is chosen for the frequencies of the place, too.
TEST(AMapOverTheBed, LetsTheTimingBeFree) {
  const std::vector<std::string> fast = {
      "timing.tolerance_um=20",
      "dynamics.y.map=[{along = \"x\", at_mm = [120, 210], freq_hz = [40, 34]}]"};
  const Made faster = made(with(kExact, fast));
  const verify::Measured& measured = faster.report.measured;
  EXPECT_LT(measured.compensated.time_s, 0.99 * measured.uncompensated.time_s);
}

const std::vector<std::string> kTools = {
    "tool.0.dynamics.x.freq_hz=45", "tool.0.dynamics.y.freq_hz=42", "tool.1.dynamics.x.freq_hz=36",
    "tool.1.dynamics.y.freq_hz=34"};

// A star and a square, drawn by either tool in turn.
std::string print_of_two_tools(int changes) {
  std::string text = "G28\nG90\nM83\nM204 S3000\n";
  for (int i = 0; i < changes; ++i) {
    text += "T" + std::to_string(i % 2) + "\nG1 Z0.3 F600\nG1 X60 Y60 F9000\n";
    text +=
        "G1 X70 Y88 E1.2 F4800\nG1 X80 Y60 E1.2\nG1 X56 Y78 E1.2\nG1 X84 Y78 E1.2\n"
        "G1 X60 Y60 E1.2\nG1 X90 Y62 E1.2\nG1 X88 Y90 E1.2\nG1 X62 Y88 E1\n"
        "G1 X61 Y61 E1\n";
  }
  return text;
}

Made made_with_tools(const std::string& text, const std::vector<std::string>& overrides,
                     unsigned workers = 2) {
  const JobFolder folder(text, with({"dynamics.freq_error=0"}, overrides));
  SilentProgress progress;
  const Result<report::Report> report = compensate(folder.job(workers), progress);
  EXPECT_TRUE(report.has_value()) << to_string(report.error());
  EXPECT_EQ(report->violation_count, 0U) << complaints(*report);
  EXPECT_EQ(report->runs.fallback, 0U) << complaints(*report);
  return {report.value_or(report::Report{}), folder.output()};
}

TEST(AToolChanger, IsCompensatedForTheToolInUse) {
  constexpr int kChanges = 20;
  const std::string text = print_of_two_tools(kChanges);
  const Made both = made_with_tools(text, kTools);
  const Made first = made_with_tools(text, {"dynamics.x.freq_hz=45", "dynamics.y.freq_hz=42"});
  const Made second = made_with_tools(text, {"dynamics.x.freq_hz=36", "dynamics.y.freq_hz=34"});
  EXPECT_LE(rms_mm(both.report), 1.1 * std::min(rms_mm(first.report), rms_mm(second.report)));
  for (const Made* const ignoring : {&first, &second}) {
    const JobFolder ignored(text, with({"dynamics.freq_error=0"}, kTools));
    ignored.set_output(ignoring->text);
    SilentProgress progress;
    const Result<report::Report> measured = verify(ignored.job(), progress);
    ASSERT_TRUE(measured) << to_string(measured.error());
    EXPECT_LE(rms_mm(both.report), 0.3 * rms_mm(*measured));
    EXPECT_NEAR(measured->measured.uncompensated.extruding.contour_rms_mm,
                both.report.measured.uncompensated.extruding.contour_rms_mm, 1e-9);
  }
}

TEST(AToolChanger, IsTheSameForAnyNumberOfWorkers) {
  const std::string text = print_of_two_tools(8);
  EXPECT_EQ(made_with_tools(text, kTools, 1).text, made_with_tools(text, kTools, 3).text);
}

TEST(AToolChanger, RefusesAToolThatThePrinterFileLacks) {
  const JobFolder folder(print_of_two_tools(2) + "T3\nG1 X10 Y10\n", kTools);
  SilentProgress progress;
  const Result<report::Report> report = compensate(folder.job(), progress);
  ASSERT_FALSE(report);
  EXPECT_EQ(to_string(report.error()),
            "in.gcode:29: tool 3 is selected, but the printer file has no [tool.3]; add it, empty "
            "if the tool swings as the printer itself");
}

// The report names the frequencies of each tool.
TEST(AToolChanger, IsToldOfInTheReport) {
  const Made both = made_with_tools(print_of_two_tools(2), kTools);
  std::string made_for;
  for (const report::PrinterFacts::Axis& axis : both.report.facts.axes) {
    made_for += axis.name + " " + axis.model + "; ";
  }
  EXPECT_EQ(made_for,
            "T0 X 45 Hz, ζ 0.06; T0 Y 42 Hz, ζ 0.06; T1 X 36 Hz, ζ 0.06; T1 Y 34 Hz, ζ 0.06; ");
}

}  // namespace
}  // namespace unflex::flow
