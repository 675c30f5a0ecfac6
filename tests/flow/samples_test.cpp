// Real prints from reading to verification: pieces and ten layers of prints, and whole ones where
// UNFLEX_SAMPLES names them.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <iterator>
#include <ostream>
#include <sstream>
#include <string>
#include <vector>

#include "acceptance.hpp"
#include "container/packed.hpp"
#include "jobs.hpp"
#include "own_limits.hpp"
#include "paths.hpp"
#include "same_print.hpp"
#include "whole_prints.hpp"

namespace unflex::flow::testing {
namespace {

// A print of the README's table, and how its row begins.
struct Row {
  std::string print;
  std::string begins;
};

// For the name ctest shows.
void PrintTo(const Row& row, std::ostream* out) { *out << row.print; }

// The figures of a row of README.md, RMS in µm: as sliced, compensated if the frequency is exact, 5
// and 10 % off, shapers likewise, and compensated for the exact frequency alone.
std::vector<double> figures_of(const Row& row) {
  const std::string page = read_file(std::filesystem::path(test_paths::kDocs) / "../README.md");
  const std::size_t begin = page.find("| " + row.begins);
  EXPECT_NE(begin, std::string::npos) << row.begins;
  const std::size_t cells = page.find(" |", begin);
  std::string text = page.substr(cells, page.find('\n', begin) - cells);
  std::ranges::replace_if(
      text, [](char c) { return c != '.' && std::isdigit(static_cast<unsigned char>(c)) == 0; },
      ' ');
  std::istringstream stream(text);
  return {std::istream_iterator<double>(stream), {}};
}

class TenLayers : public ::testing::TestWithParam<Row> {};

report::Report compensated(const Row& row, const std::string& freq_error) {
  const JobFolder folder(container::ten_layers(row.print), {"dynamics.freq_error=" + freq_error});
  SilentProgress progress;
  Result<report::Report> report = compensate(folder.job(2), progress);
  EXPECT_TRUE(report.has_value()) << to_string(report.error());
  EXPECT_EQ(report->violation_count, 0U) << complaints(*report);
  EXPECT_EQ(report->runs.fallback, 0U) << complaints(*report);
  return std::move(*report);
}

TEST_P(TenLayers, AreDrawnAsTheReadmeSays) {
  const report::Report robust = compensated(GetParam(), "0.1");
  const report::Report exact = compensated(GetParam(), "0");
  const auto worse_rms_mm = [&](double error) {
    double worst = 0.0;
    for (const report::Sensitivity& at : robust.others.sensitivity) {
      worst = std::abs(std::abs(at.frequency_error) - error) < 1e-6
                  ? std::max(worst, at.compensated.rms_mm)
                  : worst;
    }
    return worst;
  };
  const std::vector<double> told_um = figures_of(GetParam());
  ASSERT_EQ(told_um.size(), 8U);
  const std::array<std::pair<double, double>, 5> pairs = {
      {{told_um[0], testing::unshaped(robust).extruding.contour_rms_mm},
       {told_um[1], robust.measured.compensated.extruding.contour_rms_mm},
       {told_um[2], worse_rms_mm(0.05)},
       {told_um[3], worse_rms_mm(0.10)},
       {told_um[7], exact.measured.compensated.extruding.contour_rms_mm}}};
  for (const auto& [told, measured_mm] : pairs) {
    // As told with two or three digits, and as other compilers may differ in the last bits.
    EXPECT_NEAR(1e3 * measured_mm, told, 0.006 + 0.005 * told);
  }
  // "Print time grows by 0.05 to 0.32 %."
  EXPECT_GT(robust.measured.compensated.time_s, 1.0004 * robust.measured.uncompensated.time_s);
  EXPECT_LT(robust.measured.compensated.time_s, 1.00325 * robust.measured.uncompensated.time_s);
}

INSTANTIATE_TEST_SUITE_P(Readme, TenLayers,
                         ::testing::Values(Row{"wallring", "ring of walls"}, Row{"star", "star"},
                                           Row{"cube", "cube"}, Row{"textplate", "plate with text"},
                                           Row{"bracket", "bracket"}),
                         [](const auto& tested) { return tested.param.print; });

struct Sample {
  std::string name;
  double improvement = 1.0;
};

void PrintTo(const Sample& sample, std::ostream* out) { *out << sample.name; }

std::string name_of(const ::testing::TestParamInfo<Sample>& tested) { return tested.param.name; }

class RealPrint : public ::testing::TestWithParam<Sample> {};

TEST_P(RealPrint, IsDrawnAsSliced) {
  const std::filesystem::path path = unflex::testing::whole_print(GetParam().name);
  if (!std::filesystem::exists(path)) {
    GTEST_SKIP() << "UNFLEX_SAMPLES names no folder with it: " << path;
  }
  expect_compensated(read_file(path), {.workers = 2, .improvement = GetParam().improvement});
}

INSTANTIATE_TEST_SUITE_P(
    Whole, RealPrint,
    ::testing::Values(Sample{"bracket_mk3s_whole", 15.0}, Sample{"cube20_ender3_absE", 15.0},
                      Sample{"star_voron_klipper_fwretract", 15.0}, Sample{"textplate_cura", 15.0},
                      Sample{"wallring_mini_marlin2", 15.0}, Sample{"dome_snap_dense"},
                      Sample{"pins_slic3r_zhop"}, Sample{"vase_rrf_spiral"},
                      Sample{"washer_ratrig_arcs"}, Sample{"washer_ratrig_lines"}),
    name_of);

class PieceOfPrint : public ::testing::TestWithParam<Sample> {};

TEST_P(PieceOfPrint, IsDrawnAsSliced) {
  const std::filesystem::path path =
      std::filesystem::path(test_paths::kData) / ("pipeline_" + GetParam().name + ".gcode");
  expect_compensated(read_file(path), {.workers = 2, .improvement = GetParam().improvement});
}

INSTANTIATE_TEST_SUITE_P(Small, PieceOfPrint,
                         ::testing::Values(Sample{"bracket", 15.0}, Sample{"cube20", 15.0},
                                           Sample{"star", 15.0}, Sample{"textplate", 10.0},
                                           Sample{"wallring", 15.0}, Sample{"vase"},
                                           Sample{"washer_arcs"}),
                         name_of);

struct OnFirmware {
  std::string firmware;
  std::string piece;
  double rms_mm;           // at most this while extruding
  double improvement;      // RMS at least this many times less than before
  double max_lines_per_s;  // default line budget of the firmware
};

void PrintTo(const OnFirmware& tested, std::ostream* out) {
  *out << tested.firmware << ' ' << tested.piece;
}

class OtherFirmware : public ::testing::TestWithParam<OnFirmware> {};

// The improvement that is left with the firmware's whole steps; docs/firmware.md gives the numbers.
TEST_P(OtherFirmware, DrawsPiecesOfPrints) {
  const std::filesystem::path path =
      std::filesystem::path(test_paths::kData) / ("pipeline_" + GetParam().piece + ".gcode");
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
  EXPECT_GT(report->runs.compensated, 0U);
  EXPECT_LE(report->measured.output.max_lines_per_s, GetParam().max_lines_per_s);
  // Where M204 stands between lines, RepRapFirmware takes less time for the sliced file than a plan
  // in which limits hold from the next line on.
  const double most_longer = GetParam().firmware == "rrf" ? 1.015 : 1.01;
  EXPECT_LE(report->measured.compensated.time_s,
            most_longer * report->measured.uncompensated.time_s);
  // The emitted print may be a little shorter: a run's last line may end before the base would have
  // come to rest.
  EXPECT_GE(report->measured.compensated.time_s, 0.97 * report->measured.uncompensated.time_s);
  const double before = testing::unshaped(*report).extruding.contour_rms_mm;
  const double after = report->measured.compensated.extruding.contour_rms_mm;
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
}  // namespace unflex::flow::testing
