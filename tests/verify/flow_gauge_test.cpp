#include "flow_gauge.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "plain_emitter.hpp"
#include "replaying.hpp"

namespace unflex::verify {
namespace {

constexpr double kArea_mm2 = 2.0;
constexpr double kTau_s = FlowGauge::kMean_s;

// Moves along X without any ramps.
class Flow : public ::testing::Test {
 protected:
  // A negative flow pulls filament while the nozzle moves.
  void lay(double flow_mm3_s, double duration_s) { ramp(flow_mm3_s, flow_mm3_s, duration_s); }

  void ramp(double from_mm3_s, double to_mm3_s, double duration_s) {
    constexpr double kLength_mm = 10.0;
    const double filament_mm = 0.5 * (from_mm3_s + to_mm3_s) * duration_s / kArea_mm2;
    planner::PlannedMove move;
    move.segment.end_mm = {kLength_mm, 0.0, 0.0, filament_mm};
    move.segment.line = ++line_;
    move.length_mm = kLength_mm;
    move.direction = {1.0, 0.0, 0.0, filament_mm / kLength_mm};
    const double mm_per_mm3 = kLength_mm / (0.5 * (from_mm3_s + to_mm3_s) * duration_s);
    move.start_v_mm_s = from_mm3_s * mm_per_mm3;
    move.end_v_mm_s = move.cruise_v_mm_s = to_mm3_s * mm_per_mm3;
    move.accel_s = duration_s;
    move.accel_mm_s2 = (move.end_v_mm_s - move.start_v_mm_s) / duration_s;
    gauge_.play(move);
  }

  // Moves filament alone.
  void feed(double filament_mm, double duration_s) {
    planner::PlannedMove move;
    move.segment.end_mm = {0.0, 0.0, 0.0, filament_mm};
    move.segment.line = ++line_;
    move.kinematic = false;
    move.length_mm = std::abs(filament_mm);
    move.direction = {0.0, 0.0, 0.0, std::copysign(1.0, filament_mm)};
    move.cruise_v_mm_s = move.length_mm / duration_s;
    move.cruise_s = duration_s;
    gauge_.play(move);
  }

  [[nodiscard]] double max_mm3_s() const { return gauge_.stats().max_mm3_s; }
  [[nodiscard]] double max_change_mm3_s2() const { return gauge_.stats().max_change_mm3_s2; }

  FlowGauge gauge_{kArea_mm2};
  std::size_t line_ = 0;
};

TEST_F(Flow, IsNoneBeforeTheFirstMove) {
  gauge_.rest(10.0);
  EXPECT_EQ(max_mm3_s(), 0.0);
  EXPECT_EQ(max_change_mm3_s2(), 0.0);
  EXPECT_EQ(gauge_.stats().max_line, 0U);
}

TEST_F(Flow, ThatIsConstantIsItsOwnMeanFromTheLineOnThatCompletesIt) {
  for (int i = 0; i < 100; ++i) {
    lay(8.0, 1.5e-3);
  }
  EXPECT_NEAR(max_mm3_s(), 8.0, 1e-9);
  EXPECT_EQ(gauge_.stats().max_line, 14U);
  EXPECT_NEAR(max_change_mm3_s2(), 8.0 / kTau_s, 1e-6);
  EXPECT_EQ(gauge_.stats().max_change_line, 1U);
}

TEST_F(Flow, OfAShortBurstCountsOverTheWholeMean) {
  lay(8.0, 0.5 * kTau_s);
  gauge_.rest(1.0);
  EXPECT_NEAR(max_mm3_s(), 4.0, 1e-9);
  EXPECT_NEAR(max_change_mm3_s2(), 4.0 / kTau_s, 1e-6);
}

TEST_F(Flow, ThatStepsChangesByTheStepWithinTheTimeOfTheMean) {
  ramp(0.0, 8.0, 1.0);
  lay(8.0, 1.0);
  lay(14.0, 1.0);
  EXPECT_NEAR(max_mm3_s(), 14.0, 1e-9);
  EXPECT_EQ(gauge_.stats().max_line, 3U);
  EXPECT_NEAR(max_change_mm3_s2(), 6.0 / kTau_s, 1e-6);
  EXPECT_EQ(gauge_.stats().max_change_line, 3U);
}

TEST_F(Flow, ThatRampsChangesAsFastAsTheRamp) {
  ramp(0.0, 10.0, 0.5);
  ramp(10.0, 0.0, 1.0);
  EXPECT_NEAR(max_change_mm3_s2(), 20.0, 1e-6);
  // v peaks at P and falls by 20 before and by 10 behind it: m is largest where v(t) = v(t − τ).
  const double before_s = kTau_s / 3.0;
  const double behind_s = kTau_s - before_s;
  const double lost = 0.5 * (20.0 * before_s * before_s + 10.0 * behind_s * behind_s) / kTau_s;
  EXPECT_NEAR(max_mm3_s(), 10.0 - lost, 1e-9);
  EXPECT_EQ(gauge_.stats().max_line, 2U);
}

TEST_F(Flow, LeavesOutRetractionsAndWhatIsPulledOnTheWay) {
  ramp(0.0, 8.0, 1.0);
  ramp(8.0, 0.0, 1.0);
  feed(-2.0, 0.03);
  lay(-30.0, 0.03);
  feed(2.0, 0.03);
  ramp(0.0, 8.0, 1.0);
  EXPECT_LE(max_mm3_s(), 8.0);
  EXPECT_GT(max_mm3_s(), 7.9);
  EXPECT_NEAR(max_change_mm3_s2(), 8.0, 1e-6);
}

TEST_F(Flow, EndsAtAStop) {
  ramp(0.0, 8.0, 1.0);
  gauge_.rest(1.0);
  EXPECT_NEAR(max_mm3_s(), 8.0 - 0.5 * 8.0 * kTau_s, 1e-9);
  // m at the stop, as above, is gone 20 ms later.
  EXPECT_NEAR(max_change_mm3_s2(), max_mm3_s() / kTau_s, 1e-6);
  EXPECT_EQ(gauge_.stats().max_change_line, 1U);
}

TEST_F(Flow, OfASectionIsTheLargestInIt) {
  lay(8.0, 1.0);
  gauge_.rest(1.0);
  gauge_.begin_section();
  lay(5.0, 1.0);
  EXPECT_NEAR(gauge_.section().max_mm3_s, 5.0, 1e-9);
  EXPECT_EQ(gauge_.section().max_line, 2U);
  EXPECT_NEAR(max_mm3_s(), 8.0, 1e-9);
}

// Whatever the lines are, both are what a sum over small steps has.
TEST_F(Flow, IsWhatASumOverSmallStepsHas) {
  std::mt19937 random(7);
  const auto pick = [&](double most) {
    return most * static_cast<double>(random()) / static_cast<double>(std::mt19937::max());
  };
  constexpr double kStep_s = 1e-5;
  constexpr std::size_t kMean = 2000;
  std::vector<double> volume_mm3(2 * kMean + 1, 0.0);
  double flow_mm3_s = 0.0;
  for (int i = 0; i < 2000; ++i) {
    const double to_mm3_s = pick(1.0) < 0.2 ? 0.0 : pick(20.0);
    const auto steps = static_cast<std::size_t>(1.0 + pick(i % 10 == 0 ? 4000.0 : 300.0));
    const double duration_s = static_cast<double>(steps) * kStep_s;
    if (flow_mm3_s == 0.0 && to_mm3_s == 0.0) {
      gauge_.rest(duration_s);
    } else {
      ramp(flow_mm3_s, to_mm3_s, duration_s);
    }
    const double begin_mm3 = volume_mm3.back();
    for (std::size_t n = 1; n <= steps; ++n) {
      const double t = static_cast<double>(n) * kStep_s;
      volume_mm3.push_back(begin_mm3 + flow_mm3_s * t +
                           0.5 * (to_mm3_s - flow_mm3_s) * t * t / duration_s);
    }
    flow_mm3_s = pick(1.0) < 0.5 ? to_mm3_s : pick(20.0);
  }
  double mean_mm3_s = 0.0;
  double change_mm3_s2 = 0.0;
  for (std::size_t n = 2 * kMean; n < volume_mm3.size(); ++n) {
    const double now = (volume_mm3[n] - volume_mm3[n - kMean]) / kTau_s;
    const double before = (volume_mm3[n - kMean] - volume_mm3[n - 2 * kMean]) / kTau_s;
    mean_mm3_s = std::max(mean_mm3_s, now);
    change_mm3_s2 = std::max(change_mm3_s2, std::abs(now - before) / kTau_s);
  }
  EXPECT_NEAR(max_mm3_s(), mean_mm3_s, 1e-4);
  EXPECT_GE(max_mm3_s(), mean_mm3_s - 1e-9);
  EXPECT_NEAR(max_change_mm3_s2(), change_mm3_s2, 0.1);
  EXPECT_GE(max_change_mm3_s2(), change_mm3_s2 - 1e-6);
}

// ---- of files ----------------------------------------------------------------------------------

// 5 mm/s of filament of 1.75 mm.
constexpr double kFlow_mm3_s = 5.0 * 0.25 * std::numbers::pi * 1.75 * 1.75;
constexpr char kStart[] = "G90\nM83\nG1 Z0.2 F600\nG1 X1 Y1 F600\n";
constexpr char kWall[] = "G1 X81 Y1 E4 F6000\n";

TEST(FlowOfFiles, IsThatOfTheirFilament) {
  const std::string text = std::string(kStart) + "SET_VELOCITY_LIMIT ACCEL=1000\nM400\n" + kWall;
  const VerifyReport report = testing::verify_text(text, text);
  for (const FlowStats& flow :
       {report.measured.uncompensated.flow, report.measured.compensated.flow}) {
    EXPECT_NEAR(flow.max_mm3_s, kFlow_mm3_s, 1e-6);
    EXPECT_EQ(flow.max_line, 7U);
    EXPECT_NEAR(flow.max_change_mm3_s2, kFlow_mm3_s / 0.1, 1e-3) << "in 0.1 s at full speed";
    EXPECT_EQ(flow.max_change_line, 7U);
  }
}

TEST(FlowOfFiles, HasItsRestsWhereTheMachineRests) {
  const std::string burst = "E0.025 F6000\n";
  const auto flow_mm3_s = [&](const std::string& between) {
    const std::string text = std::string(kStart) + "SET_VELOCITY_LIMIT ACCEL=10000000\nG1 X1.5 " +
                             burst + between + "G1 X2 " + burst;
    const VerifyReport report = testing::verify_text(text, text);
    EXPECT_DOUBLE_EQ(report.measured.uncompensated.flow.max_mm3_s,
                     report.measured.compensated.flow.max_mm3_s);
    return report.measured.compensated.flow.max_mm3_s;
  };
  EXPECT_NEAR(flow_mm3_s("M400\n"), 0.5 * kFlow_mm3_s, 1e-6);
  EXPECT_NEAR(flow_mm3_s("G4 P100\n"), 0.25 * kFlow_mm3_s, 1e-6);
}

TEST(FlowOfFiles, IsThatOfTheSlicedFileWhereItsPlanIsDrawnInShortLines) {
  const std::string text = std::string(kStart) + kWall + "G1 X81 Y61 E3\nG1 X1 Y61 E4\n";
  const VerifyReport report = testing::verify_text(text, testing::PlainEmitter(1e-3).emit(text));
  EXPECT_EQ(report.runs, 1U);
  EXPECT_NEAR(report.measured.compensated.flow.max_mm3_s, kFlow_mm3_s, 0.005 * kFlow_mm3_s);
  EXPECT_NEAR(report.measured.compensated.flow.max_change_mm3_s2,
              report.measured.uncompensated.flow.max_change_mm3_s2,
              0.02 * report.measured.uncompensated.flow.max_change_mm3_s2);
}

TEST(FlowOfFiles, IsTooMuchOnlyAboveTheLimitAndTheSlicedFile) {
  const std::string slow = std::string(kStart) + kWall + "G4 P100\nG1 X1 Y1 E4 F15000\n";
  const std::string fast =
      std::string(kStart) + "G1 X81 Y1 E4 F12000\n" + "G4 P100\nG1 X1 Y1 E4 F15000\n";
  const auto too_much = [](const std::string& input, const std::string& output, double limit) {
    Rules rules;
    rules.max_flow_mm3_s = limit * kFlow_mm3_s;
    return testing::verify_text(input, output, rules).too_much_flow;
  };
  EXPECT_FALSE(too_much(slow, slow, 0.5));
  EXPECT_FALSE(too_much(fast, slow, 0.5));
  EXPECT_FALSE(too_much(slow, fast, 1.99));
  // The line behind the pause asks for more, but did so before.
  const std::optional<TooMuchFlow> found = too_much(slow, fast, 1.9);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->flow_mm3_s, 2.0 * kFlow_mm3_s, 1e-6);
  EXPECT_NEAR(found->sliced_mm3_s, kFlow_mm3_s, 1e-6);
  EXPECT_EQ(found->line, 5U);
}

}  // namespace
}  // namespace unflex::verify
