// Real prints through the whole pipeline: pieces that come with the tests, and, where the shared
// samples are at hand, longer stretches of all ten.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <ostream>
#include <string>
#include <string_view>

#include "acceptance.hpp"
#include "jobs.hpp"
#include "own_limits.hpp"
#include "same_print.hpp"

namespace unflex::pipeline::testing {
namespace {

struct Sample {
  std::string name;
  std::string_view layer_mark;  // the line that begins a layer
  std::size_t layers;           // as many of them; 0: all
  std::size_t lines;            // no more than this; 0: all
  double improvement;
};

// For the name ctest shows.
void PrintTo(const Sample& sample, std::ostream* out) { *out << sample.name; }

std::size_t line_end(const std::string& text, std::size_t begin) {
  return std::min(text.find('\n', begin), text.size() - 1) + 1;
}

std::string cut(const std::string& text, const Sample& sample) {
  std::size_t layers = 0;
  std::size_t lines = 0;
  for (std::size_t begin = 0; begin < text.size(); begin = line_end(text, begin)) {
    const bool new_layer =
        sample.layers > 0 && std::string_view(text).substr(begin).starts_with(sample.layer_mark);
    if ((new_layer && layers++ == sample.layers) || (sample.lines > 0 && lines++ == sample.lines)) {
      return text.substr(0, begin);
    }
  }
  return text;
}

bool whole_samples() { return std::getenv("UNFLEX_WHOLE_SAMPLES") != nullptr; }

// Names the test after the sample.
std::string name_of(const ::testing::TestParamInfo<Sample>& tested) { return tested.param.name; }

class RealPrint : public ::testing::TestWithParam<Sample> {};

TEST_P(RealPrint, IsDrawnAsSliced) {
  const Sample& sample = GetParam();
  const std::filesystem::path path =
      std::filesystem::path(UNFLEX_SHARED) / "samples" / (sample.name + ".gcode");
  if (!std::filesystem::exists(path)) {
    GTEST_SKIP() << "no shared samples beside the repository";
  }
  const std::string text = read_file(path);
  expect_compensated(whole_samples() ? text : cut(text, sample), {2, sample.improvement});
}

// The first ten layers of five prints; of the others as much as takes about as long.
INSTANTIATE_TEST_SUITE_P(
    Shared, RealPrint,
    ::testing::Values(Sample{"bracket_mk3s_whole", ";LAYER_CHANGE", 10, 0, 15.0},
                      Sample{"cube20_ender3_absE", ";LAYER_CHANGE", 10, 0, 15.0},
                      Sample{"star_voron_klipper_fwretract", ";LAYER_CHANGE", 10, 0, 15.0},
                      Sample{"textplate_cura", ";LAYER:", 10, 0, 15.0},
                      Sample{"wallring_mini_marlin2", ";LAYER_CHANGE", 10, 0, 15.0},
                      Sample{"dome_snap_dense", "", 0, 8000, 1.0},
                      Sample{"pins_slic3r_zhop", "", 0, 0, 1.0},
                      Sample{"vase_rrf_spiral", "", 0, 8000, 1.0},
                      Sample{"washer_ratrig_arcs", "", 0, 0, 1.0},
                      Sample{"washer_ratrig_lines", "", 0, 0, 1.0}),
    name_of);

class PieceOfPrint : public ::testing::TestWithParam<Sample> {};

TEST_P(PieceOfPrint, IsDrawnAsSliced) {
  const std::filesystem::path path =
      std::filesystem::path(UNFLEX_TEST_DATA) / ("pipeline_" + GetParam().name + ".gcode");
  expect_compensated(read_file(path), {2, GetParam().improvement});
}

INSTANTIATE_TEST_SUITE_P(
    Small, PieceOfPrint,
    ::testing::Values(Sample{"bracket", "", 0, 0, 15.0}, Sample{"cube20", "", 0, 0, 15.0},
                      Sample{"star", "", 0, 0, 15.0}, Sample{"textplate", "", 0, 0, 10.0},
                      Sample{"wallring", "", 0, 0, 15.0}, Sample{"vase", "", 0, 0, 1.0},
                      Sample{"washer_arcs", "", 0, 0, 1.0}),
    name_of);

struct OnFirmware {
  std::string firmware;
  std::string piece;
  double rms_mm;           // at most this while extruding
  double improvement;      // RMS at least this many times less than before
  double max_lines_per_s;  // that firmware's default budget
};

void PrintTo(const OnFirmware& tested, std::ostream* out) {
  *out << tested.firmware << ' ' << tested.piece;
}

class OtherFirmware : public ::testing::TestWithParam<OnFirmware> {};

// What the firmware's whole steps leave of it; docs/firmware.md says how much that is.
TEST_P(OtherFirmware, DrawsPiecesOfPrints) {
  const std::filesystem::path path =
      std::filesystem::path(UNFLEX_TEST_DATA) / ("pipeline_" + GetParam().piece + ".gcode");
  const std::string sliced = unflex::testing::numbered(read_file(path));
  const JobFolder folder(sliced, {"printer.firmware=" + GetParam().firmware});
  const Job job = folder.job(2);
  SilentProgress progress;
  const Result<report::Report> report = compensate(job, progress);
  ASSERT_TRUE(report.has_value()) << to_string(report.error());
  EXPECT_EQ(unflex::testing::difference(sliced, folder.output(),
                                        unflex::testing::printer_with(job.settings)),
            "");
  EXPECT_EQ(report->violation_count, 0U);
  EXPECT_GT(report->runs_compensated, 0U);
  EXPECT_LE(report->max_lines_per_s, GetParam().max_lines_per_s);
  EXPECT_LE(report->emitted_time_s, 1.01 * report->reference_time_s);
  // A run's last line may end before the base would have come to rest.
  EXPECT_GE(report->emitted_time_s, 0.97 * report->reference_time_s);
  const double before = report->uncompensated.extruding.contour_rms_mm;
  const double after = report->compensated.extruding.contour_rms_mm;
  EXPECT_LE(after, GetParam().rms_mm);
  EXPECT_LE(after, before / GetParam().improvement);
}

INSTANTIATE_TEST_SUITE_P(Small, OtherFirmware,
                         ::testing::Values(OnFirmware{"marlin", "wallring", 2e-3, 10.0, 200.0},
                                           OnFirmware{"marlin", "textplate", 1e-3, 10.0, 200.0},
                                           OnFirmware{"rrf", "cube20", 2.5e-3, 5.0, 500.0},
                                           OnFirmware{"rrf", "textplate", 1e-3, 10.0, 500.0},
                                           OnFirmware{"rrf", "washer_arcs", 2e-3, 10.0, 500.0}));

}  // namespace
}  // namespace unflex::pipeline::testing
