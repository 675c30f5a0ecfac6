// Machines whose frequencies change while a print goes on.
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "jobs.hpp"
#include "paths.hpp"
#include "unflex/core/progress.hpp"
#include "unflex/flow/flow.hpp"

namespace unflex::flow {
namespace {

using testing::complaints;
using testing::JobFolder;

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

struct Made {
  report::Report report;
  std::string text;
};

Made made(const std::vector<std::string>& overrides, unsigned workers = 2) {
  const JobFolder folder(print(), overrides);
  SilentProgress progress;
  const Result<report::Report> report = compensate(folder.job(workers), progress);
  EXPECT_TRUE(report.has_value()) << to_string(report.error());
  EXPECT_EQ(report->violation_count, 0U) << complaints(*report);
  EXPECT_EQ(report->runs.fallback, 0U) << complaints(*report);
  return {report.value_or(report::Report{}), folder.output()};
}

double rms_mm(const report::Report& report) {
  return report.measured.compensated.extruding.contour_rms_mm;
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

}  // namespace
}  // namespace unflex::flow
