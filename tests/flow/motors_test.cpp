// Motors that move two axes stay within their limits, and that costs little accuracy.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>
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

constexpr double kMaxAccel_mm_s2 = 20000.0;

// The first lines of a print, without the commands that set accelerations.
std::string beginning(const std::string& name, std::size_t lines) {
  std::ifstream file(std::filesystem::path(test_paths::kData) / name);
  EXPECT_TRUE(file.is_open()) << name;
  std::string text;
  std::size_t count = 0;
  for (std::string line; count < lines && std::getline(file, line); ++count) {
    if (!line.starts_with("M20")) {
      text += line + "\n";
    }
  }
  return text;
}

report::Report compensated(const std::string& text, const std::string& kinematics,
                           std::vector<std::string> overrides) {
  overrides.push_back("kinematics.type=" + kinematics);
  overrides.push_back("base.max_accel_mm_s2=20000");
  const JobFolder folder(text, overrides);
  SilentProgress progress;
  Result<report::Report> report = compensate(folder.job(2), progress);
  EXPECT_TRUE(report.has_value()) << to_string(report.error());
  EXPECT_EQ(report->violation_count, 0U) << complaints(*report);
  EXPECT_EQ(report->runs.fallback, 0U) << complaints(*report);
  return report.value_or(report::Report{});
}

struct Case {
  std::string name;
  std::string kinematics;
  std::string print;
  std::size_t lines;
  std::vector<std::string> overrides;
  double room;  // rounding may exceed the limit by this share
  double cost;  // ratio of the RMS to that with a motor per axis
};

void PrintTo(const Case& tested, std::ostream* out) { *out << tested.name; }

class SharedMotorsOf : public ::testing::TestWithParam<Case> {};

TEST_P(SharedMotorsOf, KeepTheirLimitsAtLittleCost) {
  const Case& tested = GetParam();
  const std::string text = beginning(tested.print, tested.lines);
  const report::Report shared = compensated(text, tested.kinematics, tested.overrides);
  const report::Report own = compensated(text, "cartesian", tested.overrides);
  EXPECT_LE(shared.measured.base.max_accel_mm_s2, (1.001 + tested.room) * kMaxAccel_mm_s2);
  EXPECT_LE(shared.measured.compensated.extruding.contour_rms_mm,
            tested.cost * own.measured.compensated.extruding.contour_rms_mm);
  EXPECT_LT(shared.measured.compensated.extruding.contour_rms_mm,
            0.2 * testing::unshaped(shared).extruding.contour_rms_mm);
}

INSTANTIATE_TEST_SUITE_P(
    Machines, SharedMotorsOf,
    ::testing::Values(
        Case{"KlipperCorexy", "corexy", "pipeline_star.gcode", 600, {}, 0.02, 1.2},
        Case{"KlipperCorexyFast",
             "corexy",
             "pipeline_star.gcode",
             600,
             // At 45 degrees the path alone takes 0.7 of a motor's limit.
             {"limits.max_accel_mm_s2=10000"},
             0.02,
             1.5},
        Case{"KlipperHybrid", "hybrid_corexy", "pipeline_star.gcode", 600, {}, 0.02, 1.2},
        Case{"KlipperCorexz", "corexz", "pipeline_vase.gcode", 300, {}, 0.02, 1.15}),
    [](const auto& tested) { return tested.param.name; });

}  // namespace
}  // namespace unflex::flow
