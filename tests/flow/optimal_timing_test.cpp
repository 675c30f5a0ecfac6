// The optimal timing from G-code to G-code.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "jobs.hpp"
#include "paths.hpp"
#include "unflex/core/progress.hpp"

namespace unflex::flow::testing {
namespace {

constexpr double kTolerance_mm = 20e-3;
const std::string kKnown = "dynamics.x.freq_hz=45";

struct Compensated {
  report::Report report;
  std::string text;
};

Compensated compensated(const std::string& print, std::vector<std::string> keys,
                        unsigned workers = 2) {
  keys.insert(keys.begin(),
              {"timing.tolerance_um=20", "timing.method=optimal", "dynamics.y.freq_hz=45",
               "printer.firmware=klipper", "printer.variant=mainline", "base.max_accel_mm_s2=20000",
               "dynamics.freq_error=0"});
  const JobFolder folder(print, keys);
  SilentProgress progress;
  const Result<report::Report> report = compensate(folder.job(workers), progress);
  EXPECT_TRUE(report.has_value()) << to_string(report.error());
  EXPECT_EQ(report->runs.total, report->runs.compensated) << complaints(*report);
  EXPECT_TRUE(report->violations.empty()) << complaints(*report);
  return {*report, folder.output()};
}

// Two layers of a tower, sliced for 250 mm/s.
std::string tower() {
  return read_file(std::filesystem::path(test_paths::kData) / "study_fasttower.gcode");
}

double largest_error_mm(const report::Report& report) {
  return report.measured.compensated.extruding.contour_max_mm;
}

TEST(OptimalTiming, PrintsFasterThanAScaledOneAndKeepsTheTolerance) {
  const report::Report optimal = compensated(tower(), {kKnown}).report;
  const report::Report scaled = compensated(tower(), {kKnown, "timing.method=scaled"}).report;
  for (const auto& piece : optimal.free_timing.scaled) {
    EXPECT_EQ(piece.reason,
              "the scaled timing takes less time than the optimal one that was found");
  }
  EXPECT_EQ(optimal.free_timing.pieces_as_sliced, 0U);
  EXPECT_LT(optimal.measured.compensated.time_s, 0.98 * scaled.measured.compensated.time_s);
  EXPECT_LE(optimal.measured.compensated.extruding.contour_p999_mm, 1.05 * kTolerance_mm);
  EXPECT_LE(largest_error_mm(optimal), 1.1 * kTolerance_mm);
  EXPECT_LE(optimal.measured.compensated_feed.max, 1.02);
}

TEST(OptimalTiming, IsTheSameForAnyNumberOfWorkers) {
  EXPECT_EQ(compensated(tower(), {kKnown}, 1).text, compensated(tower(), {kKnown}, 3).text);
}

TEST(OptimalTiming, LetsTheNozzleStrayTwiceAsFarWhereTheFrequencyIsOff) {
  const report::Report report = compensated(tower(), {kKnown, "dynamics.freq_error=0.05"}).report;
  EXPECT_LE(largest_error_mm(report), 1.1 * kTolerance_mm);
  std::size_t edges = 0;
  for (const auto& row : report.others.sensitivity) {
    if (std::abs(std::abs(row.frequency_error) - 0.05) < 1e-9) {
      ++edges;
      EXPECT_LE(row.compensated.max_mm, 1.1 * 2.0 * kTolerance_mm) << row.frequency_error;
    }
  }
  EXPECT_EQ(edges, 2U);
}

TEST(OptimalTiming, GivesWayToAScaledOneWhereAxesHaveSeveralModes) {
  const report::Report report =
      compensated(tower(), {"dynamics.x.mode=[{freq_hz=45, damping_ratio=0.06, gain=0.8}, "
                            "{freq_hz=110, damping_ratio=0.06, gain=0.2}]"})
          .report;
  EXPECT_GT(report.free_timing.pieces_scaled, 0U);
  ASSERT_FALSE(report.free_timing.scaled.empty());
  EXPECT_EQ(report.free_timing.scaled.front().reason, "the axes have several modes or plants");
}

TEST(OptimalTiming, IsStretchedWhereALayerWouldBeTooShort) {
  // Two layers of 4.9 s as sliced.
  const double free_s = compensated(tower(), {kKnown}).report.measured.compensated.time_s;
  const double long_s =
      compensated(tower(), {kKnown, "timing.min_layer_s=4"}).report.measured.compensated.time_s;
  EXPECT_LT(free_s, 7.0);
  EXPECT_NEAR(long_s, 8.0, 0.4);
}

}  // namespace
}  // namespace unflex::flow::testing
