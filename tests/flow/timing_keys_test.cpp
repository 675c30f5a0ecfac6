// What the keys of [timing] make of a small print.

#include <fmt/core.h>
#include <gtest/gtest.h>

#include <sstream>
#include <string>
#include <vector>

#include "jobs.hpp"
#include "paths.hpp"
#include "unflex/core/progress.hpp"
#include "unflex/run/move_bounds.hpp"

namespace unflex::flow {
namespace {

using testing::JobFolder;

report::Report compensated(const std::string& text, std::vector<std::string> overrides,
                           unsigned workers = 1) {
  overrides.insert(overrides.end(), {"timing.tolerance_um=20", "dynamics.freq_error=0"});
  const JobFolder folder(text, overrides);
  SilentProgress progress;
  const Result<report::Report> report = compensate(folder.job(workers), progress);
  EXPECT_TRUE(report.has_value()) << to_string(report.error());
  EXPECT_EQ(report->runs.total, report->runs.compensated) << testing::complaints(*report);
  EXPECT_TRUE(report->violations.empty()) << testing::complaints(*report);
  return *report;
}

const std::string kStart = "G90\nM83\nG1 X100 Y100 Z0.4 F6000\nG4 P500\n";

// Sides of a zigzag, with 0.05 mm of filament per mm.
std::string zigzag(int sides, double side_mm) {
  std::string text;
  for (int i = 0; i < sides; ++i) {
    text += fmt::format("G1 X{} Y{} E{}\n", 100.0 + (i % 2 == 0 ? side_mm : 0.0),
                        100.0 + 0.5 * (i + 1), 0.05 * side_mm);
  }
  return text;
}

// One move as sliced, with what it is bound by.
timing::MoveBounds bounds_of(const planner::PlannedMove& move,
                             const std::vector<std::string>& overrides,
                             gcode::FeatureKind kind = gcode::FeatureKind::other) {
  run::Piece piece;
  piece.is_run = true;
  piece.moves = {move};
  piece.move_counts = {1};
  piece.features = {kind};
  return run::move_bounds(piece, testing::settings(overrides)).front();
}

planner::PlannedMove line(double e_per_mm) {
  planner::PlannedMove move;
  move.segment.end_mm = {10.0, 0.0, 0.0, 10.0 * e_per_mm};
  move.segment.feed_mm_s = 100.0;
  move.direction = {1.0, 0.0, 0.0, e_per_mm};
  move.length_mm = 10.0;
  move.start_v_mm_s = 5.0;
  move.cruise_v_mm_s = 60.0;
  move.end_v_mm_s = 7.0;
  move.accel_mm_s2 = 1500.0;
  return move;
}

// Lines that end on whole steps swing about what was optimised, and then a run is tried again for
// less acceleration. Only what no timing makes faster stays as sliced.
TEST(FreeTiming, IsNotLostToTheGridOfSteps) {
  std::string print;
  std::istringstream star(
      testing::read_file(std::string(test_paths::kData) + "/pipeline_star.gcode"));
  constexpr int kLines = 800;
  std::string line;
  for (int i = 0; i < kLines && std::getline(star, line); ++i) {
    print += line + "\n";
  }
  const report::Report report =
      compensated(print, {"printer.firmware=rrf", "limits.max_accel_mm_s2=1500"}, 2);
  EXPECT_LE(report.free_timing.pieces_as_sliced, 2U);
  for (const report::Fallback& kept : report.free_timing.as_sliced) {
    EXPECT_EQ(kept.reason, "no faster timing was found that keeps the tolerance");
  }
}

TEST(MoveBounds, HaveTheAccelerationAsSlicedIfAsked) {
  EXPECT_EQ(bounds_of(line(0.05), {}).accel_mm_s2, planner::kNoLimit);
  EXPECT_EQ(bounds_of(line(0.05), {"timing.keep_accel_limits=true"}).accel_mm_s2, 1500.0);
}

TEST(MoveBounds, HaveTheSpeedAtWhichTheHotendMeltsTheFilament) {
  const std::vector<std::string> keys = {"extruder.max_flow_mm3_s=6",
                                         "extruder.filament_diameter_mm=2"};
  EXPECT_EQ(bounds_of(line(0.05), {}).speed_mm_s, 100.0);
  // 0.98 · 6 mm³/s over π mm² · 0.05
  EXPECT_NEAR(bounds_of(line(0.05), keys).speed_mm_s, 37.433, 1e-3);
  EXPECT_EQ(bounds_of(line(0.01), keys).speed_mm_s, 100.0);
  EXPECT_EQ(bounds_of(line(0.0), keys).speed_mm_s, 100.0);
  EXPECT_EQ(bounds_of(line(10.0), keys).speed_mm_s, 1.0);
}

TEST(MoveBounds, HaveTheToleranceOfTheirFeature) {
  const std::vector<std::string> keys = {"timing.tolerance_um=40",
                                         "timing.outer_wall_tolerance_um=10"};
  EXPECT_EQ(bounds_of(line(0.05), keys, gcode::FeatureKind::outer_wall).tolerance_mm, 10e-3);
  EXPECT_EQ(bounds_of(line(0.05), keys, gcode::FeatureKind::infill).tolerance_mm, 40e-3);
  EXPECT_EQ(bounds_of(line(0.0), keys, gcode::FeatureKind::outer_wall).tolerance_mm, 40e-3);
}

TEST(MoveBounds, AreTheSpeedsAsSlicedOfWhatIsNotFree) {
  const std::vector<std::string> keys = {"timing.features=infill, travel"};
  const timing::MoveBounds wall = bounds_of(line(0.05), keys, gcode::FeatureKind::outer_wall);
  EXPECT_EQ(wall.speed_mm_s, 60.0);
  EXPECT_EQ(wall.accel_mm_s2, 1500.0);
  EXPECT_EQ(wall.start_speed_mm_s, 5.0);
  EXPECT_EQ(wall.end_speed_mm_s, 7.0);
  EXPECT_EQ(bounds_of(line(0.05), keys, gcode::FeatureKind::infill).speed_mm_s, 100.0);
  EXPECT_EQ(bounds_of(line(0.0), keys, gcode::FeatureKind::outer_wall).speed_mm_s, 100.0);
}

TEST(TimingKeys, KeepTheAccelerationsOfThePrint) {
  const std::string text = kStart + "M204 S500\n" + zigzag(10, 20.0);
  const report::Report free = compensated(text, {});
  const report::Report kept = compensated(text, {"timing.keep_accel_limits=true"});
  EXPECT_LT(kept.measured.compensated.time_s, kept.measured.uncompensated.time_s - 0.1);
  // From rest to rest, 20 mm take 2 √(20 / 500) = 0.4 s at 500 mm/s², ten sides 4 s. At 100 mm/s
  // they take 2 s.
  EXPECT_GT(kept.measured.compensated.time_s, free.measured.compensated.time_s + 0.5);
}

TEST(TimingKeys, KeepTheFlowThatTheHotendMelts) {
  const std::string text = kStart + "M204 S500\n" + zigzag(20, 20.0);
  EXPECT_GT(compensated(text, {}).measured.compensated.flow.max_mm3_s, 10.0);
  const report::Report kept = compensated(text, {"extruder.max_flow_mm3_s=7"});
  EXPECT_LT(kept.measured.compensated.time_s, kept.measured.uncompensated.time_s - 0.1);
  EXPECT_LT(kept.measured.compensated.flow.max_mm3_s, 7.0 * 1.01);
  EXPECT_TRUE(kept.warnings.empty()) << kept.warnings.front();
}

// Stairs, whose corners a tolerance decides over.
std::string stairs(int steps) {
  std::string text;
  for (int i = 1; i <= steps; ++i) {
    text += fmt::format("G1 X{} E0.15\nG1 Y{} E0.15\n", 100 + 3 * i, 100 + 3 * i);
  }
  return text;
}

// One path as an outer wall and as an infill.
std::string two_features() {
  return kStart + "M204 S500\n;TYPE:External perimeter\n" + stairs(10) +
         "G1 X100 Y100 F6000\nG4 P500\n;TYPE:Internal infill\n" + stairs(10);
}

TEST(TimingKeys, GiveOuterWallsATolerance) {
  const report::Report even = compensated(two_features(), {});
  const report::Report finer = compensated(two_features(), {"timing.outer_wall_tolerance_um=5"});
  const report::Report coarser = compensated(two_features(), {"timing.outer_wall_tolerance_um=80"});
  EXPECT_GT(finer.measured.compensated.time_s, even.measured.compensated.time_s + 0.05);
  EXPECT_LT(coarser.measured.compensated.time_s, even.measured.compensated.time_s - 0.02);
}

TEST(TimingKeys, LeaveFeaturesAsSliced) {
  const report::Report all = compensated(two_features(), {});
  const double gain_s = all.measured.uncompensated.time_s - all.measured.compensated.time_s;
  const report::Report infill = compensated(two_features(), {"timing.features=infill"});
  // Each of the zigzags gains as much as the other.
  EXPECT_NEAR(infill.measured.uncompensated.time_s - infill.measured.compensated.time_s,
              0.5 * gain_s, 0.1 * gain_s);
}

// Layers of 10 s or so, of which the new timing takes less than half.
std::string three_layers() {
  std::string text = kStart + "M204 S200\n";
  for (int layer = 0; layer < 3; ++layer) {
    text += fmt::format(";LAYER:{}\nG1 Z{:.1f}\nG1 X100 Y100\n", layer, 0.4 + 0.2 * layer);
    text += stairs(10) + "G4 P300\nG1 X100 Y100\n" + zigzag(4, 20.0);
  }
  return text;
}

TEST(TimingKeys, KeepLayersLongEnough) {
  const report::Report free = compensated(three_layers(), {});
  const report::Report kept = compensated(three_layers(), {"timing.min_layer_s=5"});
  const report::Report sliced = compensated(three_layers(), {"timing.min_layer_s=500"});
  EXPECT_GT(free.measured.uncompensated.time_s, 3 * 5.5);
  EXPECT_LT(free.measured.compensated.time_s, 3 * 4.5);
  // Before the first layer there are a travel of 141 mm and a dwell.
  EXPECT_NEAR(kept.measured.compensated.time_s, 1.94 + 3 * 5.0, 0.1);
  EXPECT_NEAR(sliced.measured.compensated.time_s, sliced.measured.uncompensated.time_s, 0.3);
}

TEST(TimingKeys, KeepLayersLongEnoughForAnyNumberOfWorkers) {
  std::vector<std::string> outputs;
  for (const unsigned workers : {1U, 3U}) {
    const JobFolder folder(three_layers(), {"timing.tolerance_um=20", "dynamics.freq_error=0",
                                            "timing.min_layer_s=5"});
    SilentProgress progress;
    ASSERT_TRUE(compensate(folder.job(workers), progress).has_value());
    outputs.push_back(folder.output());
  }
  EXPECT_EQ(outputs.front(), outputs.back());
}

TEST(TimingKeys, ABandOfFrequenciesTellsWhatHalfOfItWouldSave) {
  const auto with_band = [](const std::string& band) {
    const JobFolder folder(kStart + zigzag(12, 20.0), {"timing.tolerance_um=20", band});
    SilentProgress progress;
    return compensate(folder.job(), progress);
  };
  const Result<report::Report> wide = with_band("dynamics.freq_error=0.1");
  ASSERT_TRUE(wide.has_value()) << to_string(wide.error());
  ASSERT_TRUE(wide->free_timing.narrower.has_value());
  EXPECT_DOUBLE_EQ(wide->free_timing.narrower->freq_error, 0.05);
  // The sample is the whole print, so what it tells is what the narrower band takes.
  const Result<report::Report> narrow = with_band("dynamics.freq_error=0.05");
  ASSERT_TRUE(narrow.has_value()) << to_string(narrow.error());
  EXPECT_NEAR(wide->measured.compensated.time_s - wide->free_timing.narrower->saves_s,
              narrow->measured.compensated.time_s, 0.02 * narrow->measured.compensated.time_s);
  EXPECT_LT(narrow->measured.compensated.time_s, wide->measured.compensated.time_s);
  EXPECT_FALSE(with_band("dynamics.freq_error=0")->free_timing.narrower.has_value());
}

}  // namespace
}  // namespace unflex::flow
