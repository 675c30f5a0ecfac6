#include "flow_difference.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "container/packed.hpp"
#include "plain_emitter.hpp"
#include "replay.hpp"
#include "replaying.hpp"

namespace unflex::verify {
namespace {

constexpr double kTau_s = FlowDifferenceGauge::kWindow_s;

// Moves along X without any ramps, at a rate of filament that is linear in time.
class TwoFiles : public ::testing::Test {
 protected:
  static planner::PlannedMove move(double from_mm_s, double to_mm_s, double duration_s) {
    constexpr double kLength_mm = 10.0;
    const double filament_mm = 0.5 * (from_mm_s + to_mm_s) * duration_s;
    planner::PlannedMove move;
    move.segment.end_mm = {kLength_mm, 0.0, 0.0, filament_mm};
    move.length_mm = kLength_mm;
    move.direction = {1.0, 0.0, 0.0, filament_mm / kLength_mm};
    move.start_v_mm_s = from_mm_s * kLength_mm / filament_mm;
    move.end_v_mm_s = move.cruise_v_mm_s = to_mm_s * kLength_mm / filament_mm;
    move.accel_s = duration_s;
    move.accel_mm_s2 = (move.end_v_mm_s - move.start_v_mm_s) / duration_s;
    return move;
  }

  static planner::PlannedMove travel(double duration_s) {
    planner::PlannedMove move;
    move.segment.end_mm = {10.0, 0.0, 0.0, 0.0};
    move.length_mm = 10.0;
    move.direction = {1.0, 0.0, 0.0, 0.0};
    move.cruise_v_mm_s = 10.0 / duration_s;
    move.cruise_s = duration_s;
    return move;
  }

  // Filament alone.
  static planner::PlannedMove feed(double filament_mm, double duration_s) {
    planner::PlannedMove move;
    move.segment.end_mm = {0.0, 0.0, 0.0, filament_mm};
    move.kinematic = false;
    move.length_mm = std::abs(filament_mm);
    move.direction = {0.0, 0.0, 0.0, std::copysign(1.0, filament_mm)};
    move.cruise_v_mm_s = move.length_mm / duration_s;
    move.cruise_s = duration_s;
    return move;
  }

  void sliced(planner::PlannedMove move) {
    move.segment.line = ++line_;
    gauge_.play_sliced(move);
  }
  void output(const planner::PlannedMove& move) { gauge_.play_output(move); }

  [[nodiscard]] FlowDifference largest() {
    gauge_.end_run();
    EXPECT_TRUE(gauge_.stats());
    return gauge_.stats().value_or(FlowDifference{});
  }

  FlowDifferenceGauge gauge_;
  std::size_t line_ = 0;
};

TEST_F(TwoFiles, AreNotComparedWhereNothingIsLaid) {
  gauge_.begin_run(0.0);
  sliced(travel(1.0));
  output(move(2.0, 2.0, 1.0));
  sliced(feed(2.0, 1.0));
  output(move(2.0, 2.0, 1.0));
  gauge_.end_run();
  EXPECT_FALSE(gauge_.stats());
}

// A share of next to nothing would be any number.
TEST_F(TwoFiles, AreNotComparedWhereHardlyAnythingIsLaid) {
  gauge_.begin_run(0.0);
  sliced(move(1e-15, 1e-15, 5.0 * kTau_s));
  output(move(1.0, 1.0, 5.0 * kTau_s));
  gauge_.end_run();
  EXPECT_FALSE(gauge_.stats());
}

TEST_F(TwoFiles, AreNotComparedInLessThanAWindow) {
  gauge_.begin_run(0.0);
  for (int i = 0; i < 10; ++i) {
    sliced(move(2.0, 2.0, 0.9 * kTau_s));
    output(move(4.0, 4.0, 0.9 * kTau_s));
    sliced(travel(1e-4));
    output(travel(1e-4));
  }
  gauge_.end_run();
  EXPECT_FALSE(gauge_.stats());
}

TEST_F(TwoFiles, OfOneConstantRateDoNotDifferHoweverTheirLinesLie) {
  gauge_.begin_run(0.0);
  sliced(move(2.0, 2.0, 0.5));
  sliced(move(2.0, 2.0, 0.5));
  for (int i = 0; i < 700; ++i) {
    output(move(2.0, 2.0, 1.0 / 700.0));
  }
  EXPECT_NEAR(largest().relative, 0.0, 1e-9);
  EXPECT_EQ(largest().line, 1U);
}

TEST_F(TwoFiles, OfTwoConstantRatesDifferByTheirRatioFromTheFirstLineOn) {
  gauge_.begin_run(0.0);
  for (int i = 0; i < 10; ++i) {
    sliced(move(2.0, 2.0, 0.1));
    output(move(2.5, 2.5, 0.1));
  }
  EXPECT_NEAR(largest().relative, 0.25, 1e-9);
  EXPECT_EQ(largest().line, 1U);
}

// A line of 4 ms in which filament is missing, or too much, counts as 4 ms of 10.
TEST_F(TwoFiles, DifferByTheirMeansAndSayWhichOneLaysMore) {
  for (const double rate_mm_s : {1.0, 3.5}) {
    FlowDifferenceGauge gauge;
    gauge.begin_run(0.0);
    for (std::size_t line = 1; line <= 10; ++line) {
      planner::PlannedMove each = move(2.0, 2.0, 0.004);
      each.segment.line = line;
      gauge.play_sliced(each);
      gauge.play_output(line == 7 ? move(rate_mm_s, rate_mm_s, 0.004) : each);
    }
    gauge.end_run();
    ASSERT_TRUE(gauge.stats());
    EXPECT_NEAR(gauge.stats()->relative, (rate_mm_s - 2.0) / 2.0 * 0.4, 1e-9);
    EXPECT_NEAR(static_cast<double>(gauge.stats()->line), 7.0, 1.0);
  }
}

// The middle of the first window that has all of it.
TEST_F(TwoFiles, NameTheLineInTheMiddleOfTheWindow) {
  gauge_.begin_run(0.0);
  for (std::size_t line = 1; line <= 100; ++line) {
    sliced(move(2.0, 2.0, 0.001));
    output(line >= 41 && line <= 50 ? move(3.0, 3.0, 0.001) : move(2.0, 2.0, 0.001));
  }
  EXPECT_NEAR(largest().relative, 0.5, 1e-9);
  EXPECT_NEAR(static_cast<double>(largest().line), 45.5, 0.6);
}

// The step from 2 to 6 comes 3 ms late: the window that ends when it comes lacks 3 ms of 4 mm/s,
// and the sliced file has 7 ms of 2 and 3 ms of 6 in it. A later one lacks as much of more.
TEST_F(TwoFiles, DifferMostWhenALateStepIsAllInTheWindow) {
  gauge_.begin_run(0.0);
  sliced(move(2.0, 2.0, 0.05));
  sliced(move(6.0, 6.0, 0.05));
  output(move(2.0, 2.0, 0.053));
  output(move(6.0, 6.0, 0.047));
  EXPECT_NEAR(largest().relative, -0.003 * 4.0 / (0.007 * 2.0 + 0.003 * 6.0), 1e-9);
  EXPECT_EQ(largest().line, 1U);
}

// s = k·t from a rest on, w the same δ later. With the window's end at t ≥ τ + δ:
// D/S = −kδτ/(kτ(t − τ/2)) = −δ/(t − τ/2), which is largest before: at the first window, t = τ,
// where D = ½k(τ − δ)² − ½kτ².
TEST_F(TwoFiles, ThatRampOneAfterTheOtherDifferMostAtTheBeginning) {
  constexpr double kLate_s = 0.002;
  gauge_.begin_run(0.0);
  sliced(move(0.0, 8.0, 1.0));
  output(travel(kLate_s));
  output(move(0.0, 8.0, 1.0));
  const double expected = (kTau_s - kLate_s) * (kTau_s - kLate_s) / (kTau_s * kTau_s) - 1.0;
  EXPECT_NEAR(largest().relative, expected, 1e-9);
}

// s falls from 8 as w does δ later: D/S = kδ/(8 − k(t − τ/2)) until the sliced ramp ends at 4, and
// with windows that reach beyond it, less.
TEST_F(TwoFiles, ThatFallOneAfterTheOtherDifferMostAtTheEnd) {
  constexpr double kLate_s = 0.002;
  constexpr double kSlope_mm_s2 = 4.0;
  gauge_.begin_run(0.0);
  sliced(move(8.0, 8.0, 1.0));
  sliced(move(8.0, 4.0, 1.0));
  sliced(move(4.0, 4.0, 1.0));
  output(move(8.0, 8.0, 1.0 + kLate_s));
  output(move(8.0, 4.0, 1.0));
  output(move(4.0, 4.0, 1.0 - kLate_s));
  const double at_end = kSlope_mm_s2 * kLate_s / (4.0 + kSlope_mm_s2 * 0.5 * kTau_s);
  EXPECT_NEAR(largest().relative, at_end, 1e-6);
  EXPECT_GE(largest().relative, at_end - 1e-12);
  EXPECT_EQ(largest().line, 2U);
}

TEST_F(TwoFiles, AreOnOneClockThatBeginsWithTheLeadIn) {
  gauge_.begin_run(0.02);
  sliced(move(2.0, 2.0, 0.1));
  sliced(move(4.0, 4.0, 0.1));
  output(travel(0.02));
  output(move(2.0, 2.0, 0.1));
  output(move(4.0, 4.0, 0.1));
  output(travel(0.02));
  EXPECT_NEAR(largest().relative, 0.0, 1e-9);
}

TEST_F(TwoFiles, DoNotSeeWhatIsLaidAroundATravel) {
  gauge_.begin_run(0.0);
  sliced(move(2.0, 2.0, 0.1));
  sliced(travel(0.001));
  sliced(move(2.0, 2.0, 0.1));
  output(move(2.0, 2.0, 0.1));
  output(move(900.0, 900.0, 0.001));
  output(move(2.0, 2.0, 0.1));
  EXPECT_NEAR(largest().relative, 0.0, 1e-9);
}

TEST_F(TwoFiles, CountFilamentThatIsFedWhileTheBaseRests) {
  gauge_.begin_run(0.0);
  sliced(move(2.0, 2.0, 0.1));
  output(move(2.0, 2.0, 0.05));
  output(feed(0.003, 0.001));
  output(move(2.0, 2.0, 0.049));
  EXPECT_NEAR(largest().relative, 0.05, 1e-9);
}

TEST_F(TwoFiles, DifferWhereTheOutputEndsTooEarly) {
  gauge_.begin_run(0.0);
  sliced(move(2.0, 2.0, 0.1));
  output(move(2.0, 2.0, 0.097));
  EXPECT_NEAR(largest().relative, -0.3, 1e-9);
}

// For 99.5 % of the time nothing differs, or for 98 %.
TEST_F(TwoFiles, HaveAQuantileOverTime) {
  for (const double burst_s : {0.01, 0.2}) {
    FlowDifferenceGauge gauge;
    gauge.begin_run(0.0);
    gauge.play_sliced(move(2.0, 2.0, 10.0));
    gauge.play_output(move(2.0, 2.0, 5.0));
    gauge.play_output(move(3.0, 3.0, burst_s));
    gauge.play_output(move(2.0, 2.0, 5.0 - burst_s));
    gauge.end_run();
    ASSERT_TRUE(gauge.stats());
    EXPECT_NEAR(gauge.stats()->relative, 0.5, 1e-9);
    EXPECT_NEAR(gauge.stats()->p99, burst_s < 0.1 ? 0.0 : 0.5, 0.005);
  }
}

TEST_F(TwoFiles, StartAfreshInEachRun) {
  gauge_.begin_run(0.0);
  sliced(move(2.0, 2.0, 0.1));
  output(move(2.0, 2.0, 0.1));
  output(move(90.0, 90.0, 0.1));
  gauge_.end_run();
  gauge_.begin_run(0.0);
  sliced(move(2.0, 2.0, 0.1));
  output(move(2.2, 2.2, 0.1));
  EXPECT_NEAR(largest().relative, 0.1, 1e-9);
  EXPECT_EQ(largest().line, 2U);
}

// Moves with three phases each, and what each file has laid every 10 µs.
class RandomFiles : public TwoFiles {
 protected:
  static constexpr double kStep_s = 1e-5;

  double pick(double most) {
    return most * static_cast<double>(random_()) / static_cast<double>(std::mt19937::max());
  }

  std::vector<planner::PlannedMove> moves(double all_s, double longest_s,
                                          std::vector<double>& laid_mm) {
    std::vector<planner::PlannedMove> result;
    double played_s = 0.0;
    double filament_mm = 0.0;
    laid_mm = {0.0};
    while (played_s < all_s) {
      const double duration_s = std::min(
          all_s - played_s, std::max(1.0, std::round(pick(longest_s) / kStep_s)) * kStep_s);
      const double from = 1.0 + pick(2.0);
      const double to = 1.0 + pick(2.0);
      result.push_back(move(from, to, duration_s));
      result.back().segment.line = result.size();
      const auto steps = static_cast<std::size_t>(std::llround(duration_s / kStep_s));
      for (std::size_t n = 1; n <= steps; ++n) {
        const double t = static_cast<double>(n) * kStep_s;
        laid_mm.push_back(filament_mm + (from + 0.5 * (to - from) / duration_s * t) * t);
      }
      filament_mm = laid_mm.back();
      played_s += duration_s;
    }
    return result;
  }

  std::mt19937 random_{11};
};

TEST_F(RandomFiles, DifferByWhatASumOverSmallStepsHas) {
  std::vector<double> sliced_mm;
  std::vector<double> output_mm;
  const auto sliced_moves = moves(3.0, 0.05, sliced_mm);
  const auto output_moves = moves(3.0, 0.002, output_mm);
  gauge_.begin_run(0.0);
  for (const planner::PlannedMove& each : sliced_moves) {
    gauge_.play_sliced(each);
  }
  for (const planner::PlannedMove& each : output_moves) {
    gauge_.play_output(each);
  }
  const auto window = static_cast<std::size_t>(std::llround(kTau_s / kStep_s));
  double expected = 0.0;
  for (std::size_t n = window; n < std::min(sliced_mm.size(), output_mm.size()); ++n) {
    const double s = sliced_mm[n] - sliced_mm[n - window];
    const double w = output_mm[n] - output_mm[n - window];
    expected = std::abs(w / s - 1.0) > std::abs(expected) ? w / s - 1.0 : expected;
  }
  EXPECT_NEAR(largest().relative, expected, 1e-3);
  EXPECT_GE(std::abs(largest().relative), std::abs(expected) - 1e-9);
}

TEST_F(RandomFiles, DifferAlikeInWhateverOrderTheyAreRead) {
  std::vector<double> laid_mm;
  const auto sliced_moves = moves(1.0, 0.05, laid_mm);
  const auto output_moves = moves(1.0, 0.002, laid_mm);
  std::vector<FlowDifference> found;
  for (const double sliced_share : {0.0, 0.02, 0.1, 0.5, 1.0}) {
    FlowDifferenceGauge gauge;
    gauge.begin_run(0.003);
    std::size_t next_sliced = 0;
    std::size_t next_output = 0;
    while (next_sliced < sliced_moves.size() || next_output < output_moves.size()) {
      if (next_output == output_moves.size() ||
          (next_sliced < sliced_moves.size() && pick(1.0) < sliced_share)) {
        gauge.play_sliced(sliced_moves[next_sliced++]);
      } else {
        gauge.play_output(output_moves[next_output++]);
      }
    }
    gauge.end_run();
    ASSERT_TRUE(gauge.stats());
    found.push_back(*gauge.stats());
  }
  for (const FlowDifference& each : found) {
    EXPECT_EQ(each.relative, found.front().relative);
    EXPECT_EQ(each.line, found.front().line);
  }
}

// ---- of files ----------------------------------------------------------------------------------

constexpr char kStart[] =
    "G90\nM83\nG1 Z0.2 F600\nG1 X1 Y1 F600\nSET_VELOCITY_LIMIT ACCEL=1000\nM400\n";

TEST(FlowDifferenceOfFiles, IsNotKnownWhereNothingIsCompensated) {
  const std::string text = std::string(kStart) + "G1 X81 Y1 E4 F6000\n";
  EXPECT_FALSE(testing::verify_text(text, text).measured.flow_difference);
}

TEST(FlowDifferenceOfFiles, IsNoneWhereThePlanIsDrawnFinely) {
  const std::string text = std::string(kStart) + "G1 X81 Y1 E4 F6000\nG1 X81 Y61 E3\n";
  const VerifyReport report = testing::verify_text(text, testing::PlainEmitter(1e-3).emit(text));
  ASSERT_TRUE(report.measured.flow_difference);
  EXPECT_LT(std::abs(report.measured.flow_difference->relative), 0.02);
}

// The cruise's first half has 4 % more filament than it should, its second half lacks as much.
TEST(FlowDifferenceOfFiles, SaysWhereFilamentIsTooMuchAndByHowMuch) {
  const std::string text =
      std::string(kStart) + "G1 X21 Y1 E1 F6000\nG1 X41 Y1 E1\nG1 X61 Y1 E1\nG1 X81 Y1 E1\n";
  std::string output = std::string(kStart) +
                       ";unflex run\nG1 X21 Y1 E1 F6000\nG1 X41 Y1 E1.04\nG1 X61 Y1 E.96\nG1 X81 "
                       "Y1 E1\n;unflex end\n";
  const VerifyReport report = testing::verify_text(text, output);
  ASSERT_TRUE(report.measured.flow_difference);
  EXPECT_NEAR(report.measured.flow_difference->relative, 0.04, 1e-6);
  EXPECT_EQ(report.measured.flow_difference->line, 8U);
}

TEST(FlowDifferenceOfFiles, IsNotKnownInFreeTiming) {
  const std::string text = std::string(kStart) + "G1 X81 Y1 E4 F6000\n";
  const std::string output =
      std::string(kStart) + ";unflex run TIMING=free\nG1 X81 Y1 E4 F6000\n;unflex end\n";
  Rules rules;
  rules.tolerance_mm = 1.0;
  const VerifyReport report = testing::verify_text(text, output, rules);
  EXPECT_EQ(report.runs, 1U);
  EXPECT_FALSE(report.measured.flow_difference);
}

// The filament of a run over time, and since when all moves have laid filament.
class Laying {
 public:
  explicit Laying(std::vector<planner::PlannedMove> moves) : moves_(std::move(moves)) {}

  // For times in rising order.
  void go_to(double time_s) {
    while (move_ < moves_.size() && begin_s_ + moves_[move_].duration_s() < time_s) {
      laid_before_mm_ += moves_[move_].segment.delta(gcode::E);
      begin_s_ += moves_[move_++].duration_s();
    }
    if (move_ < moves_.size() && !lays(moves_[move_])) {
      laying_since_s_ = begin_s_ + moves_[move_].duration_s();
    }
    laid_mm_ = laid_before_mm_;
    if (move_ < moves_.size()) {
      const gcode::Position at = moves_[move_].position_mm(time_s - begin_s_);
      laid_mm_ += at[gcode::E] - moves_[move_].segment.start_mm[gcode::E];
    }
  }
  [[nodiscard]] bool ended() const { return move_ == moves_.size(); }
  [[nodiscard]] double laid_mm() const { return laid_mm_; }
  [[nodiscard]] double laying_since_s() const { return laying_since_s_; }
  [[nodiscard]] std::size_t line() const { return moves_[move_].segment.line; }

 private:
  static bool lays(const planner::PlannedMove& move) {
    return move.segment.length_xy_mm() > 0.0 && move.segment.delta(gcode::E) > 0.0;
  }

  std::vector<planner::PlannedMove> moves_;
  std::size_t move_ = 0;
  double begin_s_ = 0.0;
  double laid_before_mm_ = 0.0;
  double laid_mm_ = 0.0;
  double laying_since_s_ = 0.0;
};

// Looks at both files of a run every 20 µs: where the machine comes from rest, 0.1 ms are too
// coarse.
void sample_run(Laying sliced, Laying output, FlowDifference& largest) {
  constexpr double kSample_s = 2e-5;
  constexpr std::size_t kSamples = 500;  // of the window
  std::vector<double> s_mm;
  std::vector<double> w_mm;
  std::vector<std::size_t> lines;
  for (double number = 0.0;; number += 1.0) {
    const double time_s = number * kSample_s;
    sliced.go_to(time_s);
    output.go_to(time_s);
    if (sliced.ended()) {
      return;
    }
    s_mm.push_back(sliced.laid_mm());
    w_mm.push_back(output.laid_mm());
    lines.push_back(sliced.line());
    const std::size_t n = s_mm.size() - 1;
    if (n < kSamples || sliced.laying_since_s() > time_s - kTau_s) {
      continue;
    }
    const double s = s_mm[n] - s_mm[n - kSamples];
    const double relative = (w_mm[n] - w_mm[n - kSamples] - s) / s;
    if (std::abs(relative) > std::abs(largest.relative)) {
      largest = {relative, lines[n - kSamples / 2]};
    }
  }
}

FlowDifference sampled(const std::string& sliced_text, const std::string& output_text) {
  const Rules rules;
  std::istringstream sliced_stream(sliced_text);
  std::istringstream output_stream(output_text);
  Replay sliced(sliced_stream, "in", rules.interpreter, rules.limits, rules.fixed,
                ReplayedFile::sliced);
  Replay output(output_stream, "out", rules.interpreter, rules.limits, rules.fixed,
                ReplayedFile::emitted);
  FlowDifference largest;
  for (;;) {
    std::vector<planner::PlannedMove> sliced_moves;
    std::vector<planner::PlannedMove> output_moves;
    planner::PlannedMove move;
    while (output.next(move)) {
      output_moves.push_back(move);
    }
    const bool compensated = output.section().compensated;
    while (sliced.next_resting(move)) {
      sliced_moves.push_back(move);
    }
    while (sliced.next(move)) {
    }
    if (compensated) {
      sample_run(Laying(sliced_moves), Laying(output_moves), largest);
    }
    if (sliced.section().kind == SectionKind::end) {
      return largest;
    }
    sliced.next_section();
    output.next_section();
  }
}

class CutInShortLines : public ::testing::TestWithParam<std::string> {};

TEST_P(CutInShortLines, DiffersByWhatSamplesHave) {
  const std::string text = container::test_data("pipeline_" + GetParam() + ".gcode");
  // So long that lines lie across the ends of ramps.
  const std::string output = testing::PlainEmitter(7e-3).emit(text);
  const VerifyReport report = testing::verify_text(text, output);
  EXPECT_GT(report.runs, 1U);
  ASSERT_TRUE(report.measured.flow_difference);
  const FlowDifference expected = sampled(text, output);
  EXPECT_GT(std::abs(expected.relative), 0.02);
  EXPECT_NEAR(report.measured.flow_difference->relative, expected.relative,
              0.01 * std::abs(expected.relative));
  EXPECT_EQ(report.measured.flow_difference->line, expected.line);
}

INSTANTIATE_TEST_SUITE_P(All, CutInShortLines, ::testing::Values("wallring", "star"),
                         [](const auto& tested) { return tested.param; });

}  // namespace
}  // namespace unflex::verify
