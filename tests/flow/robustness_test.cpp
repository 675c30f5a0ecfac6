// How a wrong frequency affects a print.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

#include "jobs.hpp"
#include "paths.hpp"
#include "unflex/core/progress.hpp"
#include "unflex/flow/flow.hpp"
#include "whole_prints.hpp"

namespace unflex::flow {
namespace {

using testing::complaints;
using testing::JobFolder;

// The first `most_lines` lines of the walls of a ring, at 10 000 mm/s² whatever the slicer asked
// for.
std::string fast_walls(std::istream& print,
                       std::size_t most_lines = std::numeric_limits<std::size_t>::max()) {
  std::string text;
  std::size_t lines = 0;
  for (std::string line; lines < most_lines && std::getline(print, line); ++lines) {
    if (!line.starts_with("M204")) {
      text += line + "\n";
    }
  }
  return text;
}

report::Report compensated(const std::string& text, std::vector<std::string> overrides) {
  overrides.insert(overrides.begin(), "limits.max_accel_mm_s2=10000");
  const JobFolder folder(text, overrides);
  Job job = folder.job(2);
  job.all_shapers = true;
  SilentProgress progress;
  Result<report::Report> report = compensate(job, progress);
  EXPECT_TRUE(report.has_value()) << to_string(report.error());
  EXPECT_EQ(report->violation_count, 0U) << complaints(*report);
  return std::move(*report);
}

// Where the frequencies are off by up to 10 %.
double worst_rms_mm(const report::Report& report, const std::string& name) {
  const std::vector<double>& errors = report.recording->frequency_errors;
  for (const report::Contender& contender : report.recording->contenders) {
    if (contender.name == name) {
      double worst = 0.0;
      for (std::size_t i = 0; i < errors.size(); ++i) {
        worst = std::abs(errors[i]) < 0.101 ? std::max(worst, contender.spreads[i].rms_mm) : worst;
      }
      return worst;
    }
  }
  ADD_FAILURE() << name << " has not been measured";
  return 0.0;
}

// A band of ±10 % improves the edges of the band and costs accuracy in its middle.
void expect_robust(const std::string& text) {
  const report::Report nominal = compensated(text, {});
  const report::Report robust = compensated(text, {"dynamics.freq_error=0.1"});
  EXPECT_LE(worst_rms_mm(robust, "unflex"), 0.8 * worst_rms_mm(nominal, "unflex"));
  EXPECT_LE(worst_rms_mm(robust, "unflex"), worst_rms_mm(robust, "ZV"));
  EXPECT_GT(robust.measured.compensated.extruding.contour_rms_mm,
            nominal.measured.compensated.extruding.contour_rms_mm)
      << "nothing is for nothing";
  EXPECT_EQ(robust.others.freq_error, 0.1);
  EXPECT_FALSE(nominal.others.robustness.has_value());
  ASSERT_TRUE(robust.others.robustness.has_value());
  // The cost of writing lines is small in comparison.
  EXPECT_NEAR(robust.others.robustness->rms_mm,
              robust.measured.compensated.extruding.contour_rms_mm,
              0.15 * robust.others.robustness->rms_mm);
  EXPECT_LT(robust.others.robustness->nominal_rms_mm,
            nominal.measured.compensated.extruding.contour_rms_mm);
  EXPECT_GT(robust.others.robustness->nominal_rms_mm, 0.0);
  EXPECT_LT(robust.measured.compensated.extruding.contour_rms_mm,
            0.2 * testing::unshaped(robust).extruding.contour_rms_mm);
}

TEST(Robustness, OfABandOfFrequenciesIsWorthAFifthAtItsEdges) {
  std::ifstream print(std::filesystem::path(test_paths::kData) / "pipeline_wallring.gcode");
  expect_robust(fast_walls(print));
}

TEST(SamplesRobustness, OfABandOfFrequenciesIsWorthAFifthAtItsEdges) {
  std::ifstream print(unflex::testing::whole_print("wallring_mini_marlin2"));
  if (!print) {
    GTEST_SKIP() << "UNFLEX_SAMPLES names no folder with wallring_mini_marlin2";
  }
  // A fifth of the print is enough; the rest is similar.
  expect_robust(fast_walls(print, 10000));
}

TEST(Robustness, MayBeOfTheDampingToo) {
  std::ifstream print(std::filesystem::path(test_paths::kData) / "pipeline_wallring.gcode");
  const std::string text = fast_walls(print);
  const auto worst_mm = [&](const report::Report& report) {
    return report.measured.compensated.extruding.contour_rms_mm;
  };
  const report::Report band =
      compensated(text, {"dynamics.freq_error=0.05", "dynamics.damping_error=0.5"});
  EXPECT_LT(worst_mm(band), 0.1 * testing::unshaped(band).extruding.contour_rms_mm);
  EXPECT_NE(worst_mm(band), worst_mm(compensated(text, {"dynamics.freq_error=0.05"})));
}

TEST(Robustness, IsReportedForEveryPrint) {
  std::ifstream print(std::filesystem::path(test_paths::kData) / "pipeline_wallring.gcode");
  const std::string text = fast_walls(print);
  const report::Report report = compensated(text, {});
  EXPECT_EQ(report.others.freq_error, 0.0);
  ASSERT_EQ(report.others.sensitivity.size(), 6U);
  const std::array<double, 6> errors = {-0.15, -0.10, -0.05, 0.05, 0.10, 0.15};
  for (std::size_t i = 0; i < errors.size(); ++i) {
    EXPECT_EQ(report.others.sensitivity[i].frequency_error, errors[i]);
    EXPECT_GT(report.others.sensitivity[i].compensated.rms_mm,
              report.measured.compensated.extruding.contour_rms_mm);
  }
  // Verifying with the wrong frequency must give the reported value.
  const JobFolder folder(text, {"limits.max_accel_mm_s2=10000"});
  SilentProgress progress;
  ASSERT_TRUE(compensate(folder.job(), progress).has_value());
  Job job = folder.job();
  job.settings.dynamics.x.freq_hz *= 1.1;
  job.settings.dynamics.y.freq_hz *= 1.1;
  const Result<report::Report> verified = verify(job, progress);
  ASSERT_TRUE(verified.has_value());
  EXPECT_NEAR(report.others.sensitivity[4].compensated.rms_mm,
              verified->measured.compensated.extruding.contour_rms_mm,
              0.01 * verified->measured.compensated.extruding.contour_rms_mm);
}

TEST(Robustness, IsComparedWithThePrintersOwnShaper) {
  std::ifstream print(std::filesystem::path(test_paths::kData) / "pipeline_wallring.gcode");
  const report::Report report = compensated(
      fast_walls(print), {"printer.input_shaper_type=mzv", "printer.input_shaper_freq_x_hz=48",
                          "printer.input_shaper_freq_y_hz=41"});
  const std::vector<report::Contender>& contenders = report.recording->contenders;
  ASSERT_GE(contenders.size(), 2U);
  const report::Contender& own = contenders[contenders.size() - 2];
  const report::Contender& played = contenders.back();
  EXPECT_EQ(own.name, "printer's MZV 48/41 Hz");
  EXPECT_TRUE(own.drawn);
  EXPECT_EQ(played.name, "as sliced, shaper on");
  EXPECT_FALSE(played.drawn);
  // The bench's machines do what the verification's do.
  ASSERT_EQ(own.spreads.size(), 7U);
  for (std::size_t i = 0; i < own.spreads.size(); ++i) {
    EXPECT_NEAR(own.spreads[i].rms_mm, played.spreads[i].rms_mm, 0.1 * played.spreads[i].rms_mm);
  }
}

}  // namespace
}  // namespace unflex::flow
