// Whole prints against themselves, where the shared samples are at hand.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "replaying.hpp"
#include "unflex/verify/verify.hpp"

namespace unflex::verify {
namespace {

class Sample : public ::testing::TestWithParam<std::string> {};

TEST_P(Sample, IsItsOwnFaultlessOutput) {
  const std::filesystem::path path =
      std::filesystem::path(UNFLEX_SHARED) / "samples" / (GetParam() + ".gcode");
  if (!std::filesystem::exists(path)) {
    GTEST_SKIP() << "no shared samples beside the repository";
  }
  std::ifstream input(path, std::ios::binary);
  std::ifstream output(path, std::ios::binary);
  Rules rules;
  rules.nozzle.step_s = 1e-3;
  SilentProgress progress;
  const auto report = verify(input, "in.gcode", output, "out.gcode", rules, progress);
  ASSERT_TRUE(report.has_value());
  EXPECT_EQ(testing::violations_of(*report), "");
  EXPECT_EQ(report->output_bytes, std::filesystem::file_size(path));
  EXPECT_NEAR(report->reference_time_s, report->emitted_time_s, 1e-9);
  EXPECT_LT(report->worst_move_extrusion_error_mm, 1e-9);
  EXPECT_GT(report->uncompensated.extruding.contour_rms_mm, 1e-3);
  const double rms = report->uncompensated.extruding.contour_rms_mm;
  EXPECT_NEAR(report->compensated.extruding.contour_rms_mm, rms, 1e-9 * rms);
  EXPECT_NEAR(report->compensated.all.contour_max_mm, report->uncompensated.all.contour_max_mm,
              1e-9);
}

INSTANTIATE_TEST_SUITE_P(All, Sample,
                         ::testing::Values("bracket_mk3s_whole", "cube20_ender3_absE",
                                           "star_voron_klipper_fwretract", "vase_rrf_spiral",
                                           "wallring_mini_marlin2", "pins_slic3r_zhop",
                                           "textplate_cura", "dome_snap_dense",
                                           "washer_ratrig_lines", "washer_ratrig_arcs"),
                         [](const auto& tested) { return tested.param; });

}  // namespace
}  // namespace unflex::verify
