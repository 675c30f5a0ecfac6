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
  std::vector<std::string> without_joints = tested.overrides;
  std::erase_if(without_joints,
                [](const std::string& one) { return one.starts_with("kinematics.joint"); });
  const report::Report own = compensated(text, "cartesian", without_joints);
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
        Case{"KlipperCorexz", "corexz", "pipeline_vase.gcode", 300, {}, 0.02, 1.15},
        Case{"KlipperTripteron", "tripteron", "pipeline_star.gcode", 600, {}, 0.02, 1.2},
        Case{"RrfTripteron",
             "tripteron",
             "pipeline_star.gcode",
             600,
             {"printer.firmware=rrf", "limits.max_z_accel_mm_s2=20000",
              "limits.max_z_velocity_mm_s=300"},
             0.05,
             1.6},
        // The belts are geared, so that motors turn twice as far for X.
        Case{"KlipperGeared",
             "linear",
             "pipeline_star.gcode",
             600,
             {"kinematics.joint_a=[2, 1, 0]", "kinematics.joint_b=[2, -1, 0]",
              "kinematics.joint_c=[0, 0, 1]"},
             0.02,
             2.0}),
    [](const auto& tested) { return tested.param.name; });

// The matrix of a CoreXY is a CoreXY.
TEST(AMatrix, MakesWhatTheMachineMakesThatItIs) {
  const std::string text = beginning("pipeline_star.gcode", 600);
  const auto written = [&](std::vector<std::string> overrides) {
    overrides.push_back("base.max_accel_mm_s2=20000");
    const JobFolder folder(text, overrides);
    SilentProgress progress;
    const Result<report::Report> report = compensate(folder.job(2), progress);
    EXPECT_TRUE(report.has_value()) << to_string(report.error());
    return folder.output();
  };
  EXPECT_EQ(written({"kinematics.type=linear", "kinematics.joint_a=[1, 1, 0]",
                     "kinematics.joint_b=[1, -1, 0]", "kinematics.joint_c=[0, 0, 1]"}),
            written({"kinematics.type=corexy"}));
}

}  // namespace
}  // namespace unflex::flow
