#include "unflex/verify/observer.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <sstream>

#include "plain_emitter.hpp"
#include "unflex/verify/verify.hpp"

namespace unflex::verify {
namespace {

constexpr char kPrint[] =
    "G28\nG90\nM83\n;TYPE:Perimeter\nG1 Z0.3 F600\nG1 X20 Y20 F6000\nG1 X50 Y20 E0.9 F4800\n"
    "G1 X50 Y50 E0.9\nG1 E-1 F1800\nG1 X20 Y20 F9000\nG4 P300\nG1 E1 F1800\nG1 X45 Y30 E1 F4800\n";

// Sums up what it is told.
class Sums final : public Observer {
 public:
  void line(const gcode::Line& line) override { lines.push_back(line.number); }
  void section(const ReferencePath& sliced, const ReferencePath& emitted) override {
    ++sections;
    paths = {&sliced, &emitted};
  }
  void step(NozzleId nozzle, const NozzleStep& step) override {
    Nozzle& sum = nozzles[{nozzle.base == NozzleBase::emitted, nozzle.model}];
    if (step.extruding) {
      sum.extruding_s += step.h_s;
      sum.squares += step.h_s * step.mean_contour2_mm2;
      sum.most = std::max(sum.most, step.largest_contour2_mm2);
    }
    if (step.measured) {
      const PathPiece& piece = (*paths[nozzle.base == NozzleBase::emitted ? 1 : 0])[step.piece];
      EXPECT_GE(step.time_s, piece.start_s - 1e-9);
      EXPECT_LE(step.time_s, piece.end_s + 1e-9);
      // The reference is on its piece.
      EXPECT_NEAR(cross(step.reference_mm - piece.start_mm, piece.direction), 0.0, 1e-9);
    }
  }
  void hold(double duration_s) override { held_s += duration_s; }
  void advanced(const ReferencePath& /*sliced*/, double time_s) override {
    EXPECT_GE(time_s, advanced_s);
    advanced_s = time_s;
  }
  [[nodiscard]] double memory_s() const override { return 0.05; }
  [[nodiscard]] bool asks_for_unshaped() const override { return true; }

  struct Nozzle {
    double extruding_s = 0.0;
    double squares = 0.0;
    double most = 0.0;
  };
  std::vector<std::size_t> lines;
  std::size_t sections = 0;
  std::array<const ReferencePath*, 2> paths{};
  std::map<std::pair<bool, std::size_t>, Nozzle> nozzles;
  double held_s = 0.0;
  double advanced_s = 0.0;
};

VerifyReport observed(const std::string& output, const Observation& observation) {
  std::istringstream in(kPrint);
  std::istringstream out(output);
  SilentProgress progress;
  return verify(in, "in", out, "out", Rules{}, progress, observation).value();
}

TEST(Observation, IsToldEveryLineAndEveryStepOfEveryNozzle) {
  Sums sums;
  Observation observation;
  observation.observer = &sums;
  observation.detuned.resize(2);
  observation.detuned[1].x = observation.detuned[1].x.detuned(0.8);
  const VerifyReport report = observed(testing::PlainEmitter().emit(kPrint), observation);
  ASSERT_EQ(report.violation_count, 0U);
  ASSERT_EQ(sums.lines.size(), 13U);
  EXPECT_EQ(sums.lines.front(), 1U);
  EXPECT_EQ(sums.lines.back(), 13U);
  EXPECT_NEAR(sums.held_s, 0.3, 1e-12);
  EXPECT_GT(sums.sections, 5U);
  EXPECT_GT(sums.advanced_s, 0.9 * report.measured.uncompensated.time_s);
  ASSERT_EQ(sums.nozzles.size(), 6U);
  ASSERT_EQ(report.detuned.size(), 2U);
  for (const auto& [id, sum] : sums.nozzles) {
    const auto& [emitted, model] = id;
    const Deviation before =
        model == 0 ? report.measured.uncompensated : report.detuned[model - 1].uncompensated;
    const Deviation after =
        model == 0 ? report.measured.compensated : report.detuned[model - 1].compensated;
    const DeviationStats& stats = (emitted ? after : before).extruding;
    EXPECT_NEAR(sum.extruding_s, stats.duration_s, 1e-9);
    EXPECT_DOUBLE_EQ(std::sqrt(sum.most), stats.contour_max_mm);
    EXPECT_NEAR(std::sqrt(sum.squares / sum.extruding_s), stats.contour_rms_mm, 1e-12);
  }
}

TEST(Observation, OfTheSameNozzleIsTheSame) {
  Observation observation;
  observation.detuned.resize(2);
  observation.detuned[1].step_s = 1e-3;
  const VerifyReport report = observed(testing::PlainEmitter().emit(kPrint), observation);
  const auto expect_near = [](const Deviation& found, const Deviation& wanted, double tolerance) {
    for (const auto& [a, b] :
         {std::pair{found.all, wanted.all}, std::pair{found.extruding, wanted.extruding}}) {
      EXPECT_NEAR(a.contour_max_mm, b.contour_max_mm, tolerance * b.contour_max_mm);
      EXPECT_NEAR(a.contour_rms_mm, b.contour_rms_mm, tolerance * b.contour_rms_mm);
    }
  };
  expect_near(report.detuned[0].uncompensated, report.measured.uncompensated, 0.0);
  expect_near(report.detuned[0].compensated, report.measured.compensated, 0.0);
  // Only a tenth of the steps are made, and a corner's largest deviation is a kink.
  expect_near(report.detuned[1].uncompensated, report.measured.uncompensated, 0.05);
  expect_near(report.detuned[1].compensated, report.measured.compensated, 0.05);
}

}  // namespace
}  // namespace unflex::verify
