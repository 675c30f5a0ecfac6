// Carelessly written files, whose meaning the rules of each firmware decide.
#include <fmt/core.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "jobs.hpp"
#include "unflex/core/progress.hpp"
#include "unflex/flow/flow.hpp"

namespace unflex::flow {
namespace {

using testing::JobFolder;

constexpr const char* kStart = "G28\nG90\nM83\nG1 X100 Y100 Z0.2 F6000\n";

struct File {
  std::string name;
  std::string text;
  // Filament of the whole file in Marlin and in RepRapFirmware, computed by hand, mm.
  double marlin_mm = 0.0;
  double rrf_mm = 0.0;
};

void PrintTo(const File& file, std::ostream* out) { *out << file.name; }

report::Report compensated(const std::string& text, const std::vector<std::string>& overrides) {
  const JobFolder folder(text, overrides);
  SilentProgress progress;
  const Result<report::Report> made = compensate(folder.job(), progress);
  EXPECT_TRUE(made) << to_string(made.error());
  if (!made) {
    return {};
  }
  EXPECT_EQ(made->violation_count, 0U) << testing::complaints(*made);
  const Result<report::Report> verified = verify(folder.job(), progress);
  EXPECT_TRUE(verified && verified->violation_count == 0U);
  EXPECT_NEAR(made->measured.compensated.extrusion_mm, made->measured.uncompensated.extrusion_mm,
              2e-5);
  return *made;
}

class CarelessFile : public ::testing::TestWithParam<File> {};

TEST_P(CarelessFile, IsCompensatedForMarlin) {
  const report::Report report = compensated(GetParam().text, {"printer.firmware=marlin"});
  EXPECT_NEAR(report.measured.compensated.extrusion_mm, GetParam().marlin_mm, 1e-4);
  EXPECT_GT(report.runs.compensated, 0U) << testing::complaints(report);
}

TEST_P(CarelessFile, IsCompensatedForRepRapFirmware) {
  const report::Report report = compensated(GetParam().text, {"printer.firmware=rrf"});
  EXPECT_NEAR(report.measured.compensated.extrusion_mm, GetParam().rrf_mm, 1e-4);
  EXPECT_GT(report.runs.compensated, 0U) << testing::complaints(report);
}

std::string with_returns(std::string text) {
  for (std::size_t at = 0; (at = text.find('\n', at)) != std::string::npos; at += 2) {
    text.insert(at, 1, '\r');
  }
  return text;
}

std::string numbered(const std::string& text) {
  std::string result;
  int number = 0;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = text.find('\n', begin);
    const std::string line = fmt::format("N{} {}", ++number, text.substr(begin, end - begin));
    unsigned checksum = 0;
    for (const char c : line) {
      checksum ^= static_cast<unsigned char>(c);
    }
    result += fmt::format("{}*{}\n", line, checksum);
    begin = end + 1;
  }
  return result;
}

const std::string kCorner = std::string(kStart) +
                            "G1 X104 E.2 F3600\nG1 Y104 E.2\nG1 E-1 F1800\nG1 X100 F9000\n"
                            "G1 E1 F1800\nG1 Y100 E.2 F3600\nM104 S0\n";

INSTANTIATE_TEST_SUITE_P(
    Of, CarelessFile,
    ::testing::Values(
        File{"Returns", with_returns(kCorner), 0.6, 0.6},
        File{"NoLastLineEnd", kCorner + "G1 X104 E.2", 0.8, 0.8},
        File{"NumbersAndChecksums", numbered(kCorner), 0.6, 0.6},
        File{"Comments", kCorner + "(wall)\nG1 X104 E.2 ;(a) *5\nG1 Y104 E.2\n", 1.0, 1.0},
        File{"NoSpaces", std::string(kStart) + "G1E.2X104F3600\nG1 X 100 Y 104 E .2\n", 0.4, 0.4},
        // In Marlin G90 and G91 also set the mode of E.
        File{"RelativeMoves",
             std::string(kStart) + "G91\nG1 X4 E.2 F3600\nG1 Y4 E.2\nG90\nM83\nG1 X100 E.2\n", 0.6,
             0.6},
        File{"RelativeMovesAndAbsoluteFilament",
             std::string(kStart) + "M82\nG92 E0\nG1 X104 E.2 F3600\nG91\nG1 Y4 E.4\nG1 X-4 E.6\n",
             1.2, 0.6},
        File{"SwitchedExtrusion",
             std::string(kStart) + "M82\nG92 E7\nG1 X104 E7.2 F3600\nM83\nG1 Y104 E.2\nM82\n"
                                   "G1 X100 E7.6\nG92 E0\nG1 Y100 E.2\nG92 E-3\nG1 X104 E-2.8\n",
             1.0, 1.2},
        File{"Inches",
             "G28\nG20\nG90\nM83\nG1 X4 Y4 Z.008 F240\nG1 X4.2 E.01 F140\nM204 P100 T120\n"
             "M201 X100 Y90 Z12\nG1 Y4.2 E.01\nM203 Z.3\nG1 X4 E.01\nG21\nG1 Y101.6 E.2\n",
             0.962, 0.962},
        File{"InchesOfRetraction",
             "G28\nG20\nG90\nM83\nG1 X4 Y4 Z.008 F240\nG1 X4.2 E.01 F140\nM207 S.05 F60\n"
             "G1 Y4.2 E.01\nG10\nG1 X4\n",
             0.508 - 1.27, 0.508 - 0.05},
        File{"FirmwareRetraction",
             std::string(kStart) + "G1 X104 E.2 F3600\nG10\nG1 Y104\nG11\nG1 X100 E.2\nG10\n", -2.6,
             -1.6},
        File{"FactorsOfFilamentAlone",
             std::string(kStart) + "M221 S90\nM220 S80\nG1 X104 E.2 F3600\nG1 E-1 F1800\n"
                                   "G1 Y104 F9000\nG1 X100 E.2 F3600\nM220 S100\n",
             0.36 - 0.9, 0.36 - 1.0},
        File{"Arcs",
             std::string(kStart) +
                 "G1 X104 E.2 F1200\nG2 X108 Y104 I4 J0 E.3\nG3 X112 Y108 R4 E.3\n"
                 "G2 X112 Y108 I2 J0 E.5\n",
             1.3, 1.3},
        File{"OriginsOfEveryKind",
             std::string(kStart) + "G1 X104 E.2 F3600\nG92 X0 Y0\nG1 X4 E.2\nM400\nG1 Y4 E.2\n"
                                   "G92.1\nG90\nM83\nG1 X104 Y104 Z.2\nG1 X108 E.2\n",
             0.8, 0.8},
        File{"Tools",
             std::string(kStart) + "T0\nG1 X100 Y100 Z.2\nG1 X104 E.2 F3600\nT1\nM221 S50\n"
                                   "G1 X104 Y104 Z.2\nG1 X100 E.2\nT0\nG1 X100 Y100 Z.2\n"
                                   "G1 X104 E.2\n",
             0.5, 0.5},
        File{"LimitsThatAreNone",
             std::string(kStart) + "G1 X104 E.2 F3600\nM204 S0\nM205 J5\nM203 Z0\nG1 Y104 E.2\n"
                                   "M203 Z300\n",
             0.4, 0.4}),
    [](const auto& tested) { return tested.param.name; });

// Marlin adds a move of fewer than six steps to the next move. Such a move, alone between two moves
// of filament, is therefore no run.
TEST(MarlinRun, NeedsAMoveThatMarlinTakes) {
  const report::Report report =
      compensated(kCorner + "G1 E-1 F1800\nG1 X100.057\nG1 E1 F1800\nG1 X104 E.2\n",
                  {"printer.firmware=marlin"});
  EXPECT_EQ(report.runs.total, 4U);
  EXPECT_EQ(report.runs.compensated, 4U) << testing::complaints(report);
}

TEST(MarlinRun, HasItsLimitsInMillimetresWhereTheFileIsInInches) {
  const JobFolder folder(
      "G20\nG90\nM83\nG1 X4 Y4 Z.008 F240\nG4 P500\nG1 X4.2 E.01 F140\nG1 Y4.2 E.01\n",
      {"printer.firmware=marlin"});
  SilentProgress progress;
  const Result<report::Report> report = compensate(folder.job(), progress);
  ASSERT_TRUE(report) << to_string(report.error());
  EXPECT_EQ(report->runs.compensated, 1U) << testing::complaints(*report);
  EXPECT_THAT(folder.output(), ::testing::HasSubstr(";unflex run\nG21\nM201 X1000000 "));
}

}  // namespace
}  // namespace unflex::flow
