// The printer's own input shaper in a verification: what the sliced file does under it, and what
// the emitted one.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <sstream>
#include <string>

#include "replaying.hpp"
#include "unflex/verify/verify.hpp"

namespace unflex::verify {
namespace {

using testing::verify_text;
using testing::violations_of;

constexpr double kZeta = 0.06;
constexpr double kOmega_rad_s = 2.0 * std::numbers::pi * 45.0;
// A straight diagonal at 100 mm/s, of 2.8 s.
constexpr char kDiagonal[] =
    "G28\nG90\nM83\nG1 Z0.2 F600\nG1 X20 Y20 F9000\nG1 X220 Y220 E10 F6000\n";
constexpr char kCorners[] =
    "G28\nG90\nM83\nG1 Z0.2 F600\nG1 X20 Y20 F9000\nG1 X60 Y20 E1.2 F6000\nG1 X60 Y50 E1\n"
    ";LAYER\nG1 X20 Y50 E1.2\nG1 E-1 F1800\nG1 Z0.6 F600\nG1 X30 Y30 F9000\nG1 Z0.2 F600\n"
    "G1 E1 F1800\nG1 X70 Y60 E1.5 F4800\nM400\nG1 X70 Y20 E1.2\nG4 P200\nG1 X20 Y20 E1.2\n"
    "PRINT_END\n";

Rules rules_with(const std::string& x_type, double x_hz, const std::string& y_type, double y_hz) {
  Rules rules;
  rules.nozzle.x = rules.nozzle.y = {kOmega_rad_s, kZeta};
  rules.nozzle.step_s = 1e-4;
  rules.fixed.shaper = {{x_type, y_type}, {0.1, 0.1}};
  rules.interpreter.shaper_freq_hz = {x_hz, y_hz};
  return rules;
}

// Looks at the middle half of the longest move, where all that rings has faded.
class Middle final : public Observer {
 public:
  struct Errors {
    double contour_mm = 0.0;
    double tracking_mm = 0.0;
    std::size_t steps = 0;
  };

  void line(const gcode::Line& /*line*/) override {}
  void section(const ReferencePath& sliced, const ReferencePath& /*emitted*/) override {
    path_ = &sliced;
  }
  void step(NozzleId nozzle, const NozzleStep& step) override {
    if (nozzle.model != 0 || !step.measured) {
      return;
    }
    const PathPiece& piece = (*path_)[step.piece];
    const double share = (step.time_s - piece.start_s) / (piece.end_s - piece.start_s);
    if (piece.length_xy_mm > 250.0 && share > 0.25 && share < 0.75) {
      Errors& found = errors[nozzle.base];
      ++found.steps;
      found.contour_mm = std::max(found.contour_mm, std::sqrt(step.contour2_mm2));
      found.tracking_mm =
          std::max(found.tracking_mm, distance(step.reference_mm, dynamics::place_mm(step.nozzle)));
    }
  }
  void hold(double /*duration_s*/) override {}
  void advanced(const ReferencePath& /*sliced*/, double /*time_s*/) override {}
  [[nodiscard]] double memory_s() const override { return 0.0; }
  [[nodiscard]] bool asks_for_unshaped() const override { return true; }

  std::map<NozzleBase, Errors> errors;

 private:
  const ReferencePath* path_ = nullptr;
};

std::map<NozzleBase, Middle::Errors> in_the_middle(const Rules& rules) {
  std::istringstream input(kDiagonal);
  std::istringstream output(kDiagonal);
  SilentProgress progress;
  Middle middle;
  Observation observation;
  observation.observer = &middle;
  EXPECT_TRUE(verify(input, "in", output, "out", rules, progress, observation).has_value());
  return middle.errors;
}

// At constant speed a shaper whose pulses have the mean time 0 changes nothing: the nozzle is on
// the line and where the plan has it, whatever the shapers of the axes.
TEST(PrinterShaper, OfKlipperKeepsAStraightDiagonalStraight) {
  const auto errors = in_the_middle(rules_with("mzv", 55.2, "ei", 43.6));
  ASSERT_EQ(errors.size(), 3U);
  for (const NozzleBase base : {NozzleBase::shaped, NozzleBase::unshaped, NozzleBase::emitted}) {
    EXPECT_GT(errors.at(base).steps, 1000U);
    EXPECT_LT(errors.at(base).contour_mm, 1e-6);
    EXPECT_LT(errors.at(base).tracking_mm, 1e-5);
  }
}

TEST(PrinterShaper, OnOneAxisAloneKeepsAStraightDiagonalStraight) {
  const auto errors = in_the_middle(rules_with("mzv", 40.0, "mzv", 0.0));
  EXPECT_LT(errors.at(NozzleBase::shaped).contour_mm, 1e-6);
  EXPECT_LT(errors.at(NozzleBase::emitted).contour_mm, 1e-6);
}

// Marlin's second pulse comes later, the first does not come sooner. With mean delays d of the axes
// a diagonal at the speed v is off by v |d_x − d_y| / 2.
TEST(PrinterShaper, OfMarlinPutsTheAxesOutOfStep) {
  Rules rules = rules_with("zv", 55.2, "zv", 40.0);
  rules.fixed.firmware = rules.interpreter.firmware = Firmware::marlin;
  const auto errors = in_the_middle(rules);
  const auto delay_s = [](double freq_hz) {
    const double share = std::sqrt(1.0 - 0.1 * 0.1);
    const double k = std::exp(-0.1 * std::numbers::pi / share);
    return k / (1.0 + k) * 0.5 / (freq_hz * share);
  };
  const double off_mm = 0.5 * 100.0 * (delay_s(40.0) - delay_s(55.2));
  EXPECT_GT(off_mm, 0.05);
  EXPECT_NEAR(errors.at(NozzleBase::shaped).contour_mm, off_mm, 2e-4);
  EXPECT_NEAR(errors.at(NozzleBase::emitted).contour_mm, off_mm, 2e-4);
}

void expect_same(const DeviationStats& a, const DeviationStats& b) {
  EXPECT_DOUBLE_EQ(a.contour_max_mm, b.contour_max_mm);
  EXPECT_DOUBLE_EQ(a.contour_p99_mm, b.contour_p99_mm);
  EXPECT_NEAR(a.contour_rms_mm, b.contour_rms_mm, 1e-12);
  EXPECT_DOUBLE_EQ(a.tracking_max_mm, b.tracking_max_mm);
  EXPECT_NEAR(a.tracking_rms_mm, b.tracking_rms_mm, 1e-12);
  EXPECT_NEAR(a.duration_s, b.duration_s, 1e-9);
  EXPECT_EQ(a.contour_max_line, b.contour_max_line);
}

TEST(PrinterShaper, AnIdenticalFileIsNeitherBetterNorWorse) {
  for (const double freq_hz : {0.0, 48.0}) {
    const VerifyReport report =
        verify_text(kCorners, kCorners, rules_with("mzv", freq_hz, "zv", freq_hz));
    EXPECT_EQ(violations_of(report), "");
    expect_same(report.measured.uncompensated.extruding, report.measured.compensated.extruding);
    expect_same(report.measured.uncompensated.all, report.measured.compensated.all);
    EXPECT_DOUBLE_EQ(report.measured.uncompensated.lag.max_mm,
                     report.measured.compensated.lag.max_mm);
    EXPECT_DOUBLE_EQ(report.measured.uncompensated.time_s, report.measured.compensated.time_s);
    EXPECT_EQ(report.measured.unshaped.has_value(), freq_hz > 0.0);
  }
}

// A shaper leaves less swing, and it changes neither how long the print takes nor how long it lays
// filament. The unshaped figures are those of a printer without one.
TEST(PrinterShaper, BeforeIsWhatThePrinterPlaysToday) {
  const VerifyReport plain = verify_text(kCorners, kCorners, rules_with("mzv", 0.0, "mzv", 0.0));
  const VerifyReport shaped = verify_text(kCorners, kCorners, rules_with("mzv", 45.0, "mzv", 45.0));
  ASSERT_TRUE(shaped.measured.unshaped.has_value());
  expect_same(shaped.measured.unshaped->extruding, plain.measured.uncompensated.extruding);
  expect_same(shaped.measured.unshaped->all, plain.measured.uncompensated.all);
  EXPECT_LT(shaped.measured.uncompensated.extruding.contour_rms_mm,
            0.8 * plain.measured.uncompensated.extruding.contour_rms_mm);
  EXPECT_NEAR(shaped.measured.uncompensated.extruding.duration_s,
              plain.measured.uncompensated.extruding.duration_s, 1e-9);
  EXPECT_NEAR(shaped.measured.uncompensated.all.duration_s,
              plain.measured.uncompensated.all.duration_s, 1e-9);
  EXPECT_DOUBLE_EQ(shaped.measured.uncompensated.time_s, plain.measured.uncompensated.time_s);
}

// The sliced file may have its own shaper; it acts from there on.
TEST(PrinterShaper, OfTheSlicedFileActsFromItsLineOn) {
  std::string set = kDiagonal;
  set += "SET_INPUT_SHAPER SHAPER_FREQ_X=45 SHAPER_FREQ_Y=45\nG1 X20 Y220 E10\nG1 X20 Y20 E10\n";
  const VerifyReport report = verify_text(set, set, rules_with("mzv", 0.0, "mzv", 0.0));
  ASSERT_TRUE(report.measured.unshaped.has_value());
  EXPECT_LT(report.measured.uncompensated.extruding.contour_rms_mm,
            report.measured.unshaped->extruding.contour_rms_mm);
  expect_same(report.measured.uncompensated.extruding, report.measured.compensated.extruding);
}

// A macro may change pressure advance, but the last value known is the best guess: a switch takes
// 40 ms with it instead of 20.
TEST(PrinterShaper, SwitchesAsSlowlyBehindAMacroAsBefore) {
  const auto switched_s = [](const std::string& between) {
    const std::string text = "G28\nG90\nM83\nG1 Z1 F600\nG1 X20 Y20 F6000\n" + between +
                             "SET_INPUT_SHAPER SHAPER_FREQ_X=0 SHAPER_FREQ_Y=0\nG1 E1 F600\n";
    return verify_text(text, text, rules_with("mzv", 100.0, "mzv", 100.0))
        .measured.compensated.time_s;
  };
  const double without_s = switched_s("MY_MACRO\n");
  const double with_s = switched_s("SET_PRESSURE_ADVANCE ADVANCE=0.05\n");
  EXPECT_GT(with_s, without_s + 0.02);
  EXPECT_DOUBLE_EQ(switched_s("SET_PRESSURE_ADVANCE ADVANCE=0.05\nMY_MACRO\n"), with_s);
}

}  // namespace
}  // namespace unflex::verify
