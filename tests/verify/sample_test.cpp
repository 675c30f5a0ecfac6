// Prints against themselves.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>

#include "container/packed.hpp"
#include "replaying.hpp"
#include "unflex/verify/verify.hpp"
#include "whole_prints.hpp"

namespace unflex::verify {
namespace {

void expect_faultless(const std::string& text) {
  std::istringstream input(text);
  std::istringstream output(text);
  Rules rules;
  rules.nozzle.step_s = 1e-3;
  SilentProgress progress;
  const auto report = verify(input, "in.gcode", output, "out.gcode", rules, progress);
  ASSERT_TRUE(report.has_value());
  EXPECT_EQ(testing::violations_of(*report), "");
  EXPECT_EQ(report->measured.output.bytes, text.size());
  EXPECT_NEAR(report->measured.uncompensated.time_s, report->measured.compensated.time_s, 1e-9);
  EXPECT_LT(report->measured.worst_move_extrusion_error_mm, 1e-9);
  EXPECT_GT(report->measured.uncompensated.extruding.contour_rms_mm, 1e-3);
  const double rms = report->measured.uncompensated.extruding.contour_rms_mm;
  EXPECT_NEAR(report->measured.compensated.extruding.contour_rms_mm, rms, 1e-9 * rms);
  EXPECT_NEAR(report->measured.compensated.all.contour_max_mm,
              report->measured.uncompensated.all.contour_max_mm, 1e-9);
}

class Cut : public ::testing::TestWithParam<std::string> {};

TEST_P(Cut, IsItsOwnFaultlessOutput) { expect_faultless(container::ten_layers(GetParam())); }

INSTANTIATE_TEST_SUITE_P(All, Cut, ::testing::Values("cube", "star", "wallring"),
                         [](const auto& tested) { return tested.param; });

class Sample : public ::testing::TestWithParam<std::string> {};

TEST_P(Sample, IsItsOwnFaultlessOutput) {
  const std::filesystem::path path = unflex::testing::whole_print(GetParam());
  if (!std::filesystem::exists(path)) {
    GTEST_SKIP() << "UNFLEX_SAMPLES names no folder with it: " << path;
  }
  std::ifstream file(path, std::ios::binary);
  expect_faultless({std::istreambuf_iterator<char>(file), {}});
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
