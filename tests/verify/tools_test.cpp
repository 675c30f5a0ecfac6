// Each tool of a tool changer is measured with its own nozzle.
#include <gtest/gtest.h>

#include <numbers>
#include <sstream>
#include <string>
#include <utility>

#include "replaying.hpp"
#include "unflex/core/progress.hpp"

namespace unflex::verify {
namespace {

constexpr double kZeta = 0.06;
constexpr double kHoldIsShort_s = 0.01;

NozzleModel nozzle(double x_hz, double y_hz) {
  return {{dynamics::from_frequency(x_hz, kZeta), dynamics::from_frequency(y_hz, kZeta)},
          5e-4,
          kHoldIsShort_s};
}

const NozzleModel kOwn = nozzle(60.0, 60.0);
const NozzleModel kFirst = nozzle(45.0, 45.0);
const NozzleModel kSecond = nozzle(36.0, 30.0);

Rules with_tools() {
  Rules rules;
  rules.nozzle = kOwn;
  rules.tools = {{0, kFirst, {}, {}}, {1, kSecond, {}, {}}};
  rules.interpreter.tools = {0, 1};
  return rules;
}

Rules with_one(const NozzleModel& model) {
  Rules rules;
  rules.nozzle = model;
  return rules;
}

// A square that begins at rest.
constexpr char kSquare[] =
    "G1 X20 Y20 F6000\nG4 P400\nG1 X60 Y20 E1.2 F3600\nG1 X60 Y50 E0.9\nG1 X20 Y50 E1.2\n"
    "G1 X20 Y20.5 E0.88\nG4 P400\n";
const std::string kBegin = "G28\nG90\nM83\nG1 Z0.3 F600\n";

VerifyReport measured(const std::string& text, const Rules& rules,
                      const Observation& observation = {}) {
  std::istringstream input(text);
  std::istringstream output(text);
  SilentProgress progress;
  const Result<VerifyReport> report =
      verify(input, "in.gcode", output, "out.gcode", rules, progress, observation);
  EXPECT_TRUE(report) << to_string(report.error());
  return report.value_or(VerifyReport{});
}

double square_sum(const DeviationStats& stats) {
  return stats.contour_rms_mm * stats.contour_rms_mm * stats.duration_s;
}

TEST(TwoTools, AreMeasuredAsEachAlone) {
  const std::string square(kSquare);
  const std::string one = kBegin + "T0\n" + square;
  const Measured both =
      measured(kBegin + "T0\n" + square + "T1\n" + square + "T0\n" + square, with_tools()).measured;
  const Measured first = measured(one, with_one(kFirst)).measured;
  const Measured second = measured(one, with_one(kSecond)).measured;
  for (PlayedFile Measured::*const of : {&Measured::uncompensated, &Measured::compensated}) {
    const DeviationStats& a = (first.*of).extruding;
    const DeviationStats& b = (second.*of).extruding;
    const DeviationStats& sum = (both.*of).extruding;
    EXPECT_GT(b.contour_rms_mm, 1.2 * a.contour_rms_mm);
    EXPECT_NEAR(sum.duration_s, 2.0 * a.duration_s + b.duration_s, 1e-9);
    EXPECT_NEAR(square_sum(sum) / (2.0 * square_sum(a) + square_sum(b)), 1.0, 1e-3);
    EXPECT_NEAR(sum.contour_max_mm / b.contour_max_mm, 1.0, 1e-3);
  }
}

// Before the first line that selects a tool, tool 0 is in use.
TEST(TwoTools, BeginWithTheFirst) {
  const std::string text = kBegin + kSquare;
  EXPECT_NEAR(measured(text, with_tools()).measured.uncompensated.extruding.contour_rms_mm,
              measured(text, with_one(kFirst)).measured.uncompensated.extruding.contour_rms_mm,
              1e-6);
  Rules without_first = with_tools();
  without_first.tools.erase(without_first.tools.begin());
  EXPECT_NEAR(measured(text, without_first).measured.uncompensated.extruding.contour_rms_mm,
              measured(text, with_one(kOwn)).measured.uncompensated.extruding.contour_rms_mm, 1e-6);
}

// The nozzles beside the first follow the tool, too.
TEST(TwoTools, HaveTheirDetunedNozzles) {
  const std::string text = kBegin + "T1\n" + kSquare;
  const Observation tools{{kOwn}, nullptr, {{kFirst}, {kFirst}}};
  const VerifyReport report = measured(text, with_tools(), tools);
  ASSERT_EQ(report.detuned.size(), 1U);
  EXPECT_NEAR(report.detuned.front().uncompensated.extruding.contour_rms_mm,
              measured(text, with_one(kFirst)).measured.uncompensated.extruding.contour_rms_mm,
              1e-5);
}

// A tool may have more modes or fewer than the printer itself.
TEST(TwoTools, MayHaveOtherModes) {
  const auto two_modes = [](double hz) {
    NozzleModel model = nozzle(hz, hz);
    for_each_axis(
        [](dynamics::FlexibleAxis& axis) {
          axis = axis.followed_by(2.0 * std::numbers::pi * 100.0, kZeta);
        },
        model);
    return model;
  };
  const std::string text = kBegin + "T0\n" + kSquare + "T1\n" + kSquare;
  for (const auto& [own, other] :
       {std::pair{two_modes(60.0), kSecond}, std::pair{kOwn, two_modes(36.0)}}) {
    Rules rules = with_one(own);
    rules.tools = {{1, other, {}, {}}};
    const DeviationStats both = measured(text, rules).measured.uncompensated.extruding;
    const std::string alone = kBegin + "T0\n" + kSquare;
    const double sum =
        square_sum(measured(alone, with_one(own)).measured.uncompensated.extruding) +
        square_sum(measured(alone, with_one(other)).measured.uncompensated.extruding);
    EXPECT_NEAR(square_sum(both) / sum, 1.0, 1e-3);
  }
}

TEST(TwoTools, AreNotThree) {
  const std::string text = kBegin + "T0\nG1 X1\nT3\nG1 X2\n";
  std::istringstream input(text);
  std::istringstream output(text);
  SilentProgress progress;
  const Result<VerifyReport> report =
      verify(input, "in.gcode", output, "out.gcode", with_tools(), progress);
  ASSERT_FALSE(report);
  EXPECT_EQ(to_string(report.error()),
            "in.gcode:7: tool 3 is selected, but the printer file has no [tool.3]; add it, empty "
            "if the tool swings as the printer itself");
}

}  // namespace
}  // namespace unflex::verify
