// The line of plastic of a whole print, before and after, on each firmware.
#include <fmt/core.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <string_view>
#include <vector>

#include "jobs.hpp"
#include "unflex/core/progress.hpp"

namespace unflex::flow::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

struct Machine {
  std::string_view name;
  std::vector<std::string> overrides;
  std::string_view in_runs;  // the line that sets pressure advance for runs
  std::string_view back;     // and the one that sets it back
  double most;               // share of the error under the printer's own that may be left
};

void PrintTo(const Machine& machine, std::ostream* out) { *out << machine.name; }

const std::vector<std::string> kAxes = {"dynamics.x.freq_hz=45", "dynamics.x.damping_ratio=0.06",
                                        "dynamics.y.freq_hz=45", "dynamics.y.damping_ratio=0.06"};

report::Report compensated(const std::string& print, std::vector<std::string> overrides,
                           std::string& output) {
  overrides.insert(overrides.begin(), "pressure.written=true");
  overrides.insert(overrides.end(), kAxes.begin(), kAxes.end());
  const JobFolder folder(print, overrides);
  SilentProgress progress;
  const auto report = compensate(folder.job(), progress);
  EXPECT_TRUE(report) << to_string(report.error());
  EXPECT_EQ(complaints(*report), "");
  output = folder.output();
  return *report;
}

// A wall with twelve corners, and a zigzag of infill.
std::string walls() {
  std::string text = "G28\nG90\nM83\nG1 Z0.2 F600\nG1 X50 Y50 F9000\nG1 F5400\n";
  for (int corner = 1; corner <= 12; ++corner) {
    const double angle = std::numbers::pi / 6.0 * corner;
    const double radius = corner % 2 == 0 ? 20.0 : 12.0;
    text += fmt::format("G1 X{:.3f} Y{:.3f} E0.5\n", 50.0 + radius * std::cos(angle),
                        50.0 + radius * std::sin(angle));
  }
  text += "G1 X80 Y80 F9000\nG1 F6000\n";
  for (int side = 0; side < 8; ++side) {
    text += fmt::format("G1 X{} Y{:.1f} E0.6\n", side % 2 == 0 ? 95 : 80, 80.0 + 0.5 * side);
  }
  return text;
}

class LaidLine : public ::testing::TestWithParam<Machine> {};

TEST_P(LaidLine, IsAsWideAsSliced) {
  std::string output;
  std::vector<std::string> overrides = GetParam().overrides;
  const report::Report written = compensated(walls(), overrides, output);
  EXPECT_THAT(output, HasSubstr(GetParam().in_runs));
  EXPECT_GT(output.rfind(GetParam().back), output.rfind(";unflex end"));
  overrides.push_back("pressure.written=false");
  const report::Report own = compensated(walls(), overrides, output);
  EXPECT_THAT(output, Not(HasSubstr(GetParam().in_runs)));
  ASSERT_TRUE(written.measured.uncompensated.line.is_known() &&
              own.measured.uncompensated.line.is_known());
  const verify::LineStats& line = written.measured.compensated.line;
  EXPECT_LT(line.width.rms, GetParam().most * own.measured.compensated.line.width.rms);
  EXPECT_LT(line.width.rms, 0.5 * written.measured.uncompensated.line.width.rms);
  EXPECT_LT(line.edge.rms_mm, GetParam().most * own.measured.compensated.line.edge.rms_mm);
  // The sliced file is the same.
  EXPECT_EQ(written.measured.uncompensated.line.width.rms,
            own.measured.uncompensated.line.width.rms);
  // All else is as without.
  EXPECT_NEAR(written.measured.compensated.extruding.contour_rms_mm,
              own.measured.compensated.extruding.contour_rms_mm,
              0.1 * own.measured.compensated.extruding.contour_rms_mm);
  EXPECT_NEAR(written.measured.compensated.extrusion_mm, own.measured.compensated.extrusion_mm,
              1e-4);
  EXPECT_NEAR(written.measured.compensated.time_s, own.measured.compensated.time_s,
              2e-3 * own.measured.compensated.time_s);
}

// With a bowden the nozzle may not go as fast as its own tolerance would let it.
TEST(LaidLineOfABowden, HasItsWidthWithFreeTiming) {
  const std::vector<std::string> bowden = {"printer.firmware=klipper", "timing.tolerance_um=20",
                                           "extruder.pressure_advance_s=0.4",
                                           "pressure.max_extruder_accel_mm_s2=5000"};
  std::string output;
  const report::Report even = compensated(walls(), bowden, output);
  std::vector<std::string> any = bowden;
  any.push_back("timing.width_tolerance=0");
  const report::Report fast = compensated(walls(), any, output);
  ASSERT_TRUE(even.measured.uncompensated.line.is_known() &&
              fast.measured.uncompensated.line.is_known());
  EXPECT_GT(fast.measured.compensated.line.width.p99, 0.2);
  EXPECT_LT(even.measured.compensated.line.width.p99, 0.1);
  EXPECT_GT(even.measured.compensated.time_s, fast.measured.compensated.time_s);
}

INSTANTIATE_TEST_SUITE_P(
    Firmwares, LaidLine,
    ::testing::Values(Machine{"klipper",
                              {"printer.firmware=klipper", "extruder.pressure_advance_s=0.04"},
                              "\nSET_PRESSURE_ADVANCE ADVANCE=0.04 SMOOTH_TIME=0.008\n",
                              "\nSET_PRESSURE_ADVANCE ADVANCE=0.04 SMOOTH_TIME=0.04\n",
                              0.25},
                      Machine{"marlin",
                              {"printer.firmware=marlin", "printer.linear_advance_s=0.04"},
                              "\nM900 K0\n",
                              "\nM900 K0.04\n",
                              0.7},
                      Machine{"rrf",
                              {"printer.firmware=rrf", "extruder.pressure_advance_s=0.04"},
                              "\nM572 D0 S0\n",
                              "\nM572 D0 S0.04\n",
                              1.5}),
    [](const auto& machine) { return std::string(machine.param.name); });

TEST(LaidLineOf, AFileFollowsTheAdvanceThatItSets) {
  std::string output;
  const std::string print = "SET_PRESSURE_ADVANCE ADVANCE=0.05\n" + walls();
  const report::Report report = compensated(print, {"printer.firmware=klipper"}, output);
  ASSERT_TRUE(report.measured.uncompensated.line.is_known());
  EXPECT_GT(output.rfind("\nSET_PRESSURE_ADVANCE ADVANCE=0.05 SMOOTH_TIME=0.04\n"),
            output.rfind(";unflex end"));
  EXPECT_LT(report.measured.compensated.line.width.rms, 0.05);
}

TEST(LaidLineOf, APrinterWithoutAdvanceNeedsThatOfItsHotend) {
  std::string output;
  const report::Report nothing = compensated(walls(), {"printer.firmware=klipper"}, output);
  EXPECT_FALSE(nothing.measured.uncompensated.line.is_known());
  EXPECT_THAT(output, Not(HasSubstr("PRESSURE")));
  const report::Report known =
      compensated(walls(), {"printer.firmware=klipper", "pressure.advance_s=0.04"}, output);
  ASSERT_TRUE(known.measured.uncompensated.line.is_known());
  EXPECT_GT(output.rfind("\nSET_PRESSURE_ADVANCE ADVANCE=0 SMOOTH_TIME=0.04\n"),
            output.rfind(";unflex end"));
  EXPECT_LT(known.measured.compensated.line.width.rms,
            0.1 * known.measured.uncompensated.line.width.rms);
}

TEST(LaidLineOf, ABentPressureIsMadeUpForAsWell) {
  for (const std::string shape : {"two_slopes", "tanh", "reciprocal"}) {
    std::string output;
    const report::Report report = compensated(
        walls(),
        {"printer.firmware=klipper", "pressure.advance_s=0.03", "pressure.shape=" + shape,
         "pressure.offset_mm=0.04", "pressure.knee_mm_s=2", "pressure.second_advance_s=0.02",
         "pressure.dead_time_ms=3", "extruder.instantaneous_corner_velocity_mm_s=5",
         "extruder.max_extrude_only_accel_mm_s2=10000"},
        output);
    ASSERT_TRUE(report.measured.uncompensated.line.is_known()) << shape;
    EXPECT_LT(report.measured.compensated.line.width.rms, 0.03) << shape;
  }
}

}  // namespace
}  // namespace unflex::flow::testing
