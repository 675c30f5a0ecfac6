#include "laid_line.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "replaying.hpp"

namespace unflex::verify {
namespace {

constexpr double kStep_s = 1e-4;
constexpr double kAdvance_s = 0.04;
constexpr double kPerMm = 0.05;  // filament

// A line of 60 mm from rest to rest along X, and a nozzle that follows it exactly.
class Straight : public ::testing::Test {
 protected:
  Straight() {
    planner::Limits limits;
    limits.max_accel_mm_s2 = 3000.0;
    moves_ = testing::plan_path({{0.0, 0.0, 100.0}, {60.0, 0.0, 100.0, 60.0 * kPerMm}}, limits);
    path_.begin_section();
    path_.extend_to(10.0);
  }

  LineStats laid(const LineModel& model, const planner::FirmwareAdvance& advance,
                 double times = 1.0, double contour_mm = 0.0) {
    LaidLine line(model);
    line.set(model.hotend, advance);
    line.begin_section(path_);
    const planner::PlannedMove& move = moves_.front();
    for (double t = 0.0; t < move.duration_s(); t += kStep_s) {
      const double until_s = std::min(t + kStep_s, move.duration_s());
      line.add(
          path_,
          {until_s - t, times * kPerMm * (move.distance_mm(until_s) - move.distance_mm(t)),
           times * kPerMm * move.velocity_mm_s(t), times * kPerMm * move.velocity_mm_s(until_s),
           true, contour_mm * contour_mm, PathPlace{0, move.distance_mm(until_s)}});
    }
    line.rest(0.5);
    line.finish();
    return line.stats();
  }

  // Filament that has come out at time t with nothing advanced: V = e − K q, q̇ = (ė − q)/K.
  std::vector<double> widths_without_advance() {
    const planner::PlannedMove& move = moves_.front();
    std::vector<double> at_mm;
    std::vector<double> out_mm;
    double flow = 0.0;
    constexpr double kFine_s = 1e-6;
    double next_mm = 1.0;
    for (double t = 0.0; t < move.duration_s(); t += kFine_s) {
      flow += kFine_s * (kPerMm * move.velocity_mm_s(t) - flow) / kAdvance_s;
      if (move.distance_mm(t) >= next_mm) {
        out_mm.push_back(kPerMm * move.distance_mm(t) - kAdvance_s * flow);
        next_mm += 0.4;
      }
    }
    std::vector<double> widths;
    for (std::size_t i = 1; i < out_mm.size() && 1.0 + 0.4 * static_cast<double>(i) <= 59.0 + 1e-9;
         ++i) {
      widths.push_back((out_mm[i] - out_mm[i - 1]) / (0.4 * kPerMm) - 1.0);
    }
    return widths;
  }

  std::vector<planner::PlannedMove> moves_;
  std::size_t taken_ = 0;
  ReferencePath path_{[this](ReferenceMove& next) {
    if (taken_ == moves_.size()) {
      return false;
    }
    next.move = moves_[taken_++];
    return true;
  }};
};

TEST_F(Straight, IsAsWideAsSlicedWithoutPressureOrWithTheRightAdvance) {
  const LineModel model{.hotend = {.advance_s = kAdvance_s}};
  const LineStats stats = laid(model, {kAdvance_s, 0.0});
  EXPECT_NEAR(stats.length_mm, 58.0, 1e-9);
  EXPECT_LT(stats.width.rms, 2e-3);
  EXPECT_LT(std::abs(stats.width.largest), 0.01);
  EXPECT_EQ(stats.width.wide, 0.0);
}

TEST_F(Straight, IsTooThinAtItsBeginAndTooWideAtItsEndWithoutAdvance) {
  const LineModel model{.hotend = {.advance_s = kAdvance_s}};
  const LineStats stats = laid(model, {});
  const std::vector<double> widths = widths_without_advance();
  double sum2 = 0.0;
  double largest = 0.0;
  double wide = 0.0;
  for (const double w : widths) {
    sum2 += w * w;
    largest = std::abs(w) > std::abs(largest) ? w : largest;
    wide += std::abs(w) > 0.1 ? 1.0 : 0.0;
  }
  const auto count = static_cast<double>(widths.size());
  EXPECT_NEAR(stats.length_mm, 0.4 * count, 0.41);
  EXPECT_NEAR(stats.width.rms, std::sqrt(sum2 / count), 5e-3);
  EXPECT_NEAR(stats.width.largest, largest, 0.02);
  EXPECT_NEAR(stats.width.wide, wide / count, 1.1 / count);
}

// The first millimetre gets what has come out when the nozzle has made it, and the last what comes
// out from there on until it stands.
TEST_F(Straight, MeasuresItsEndsAsAWhole) {
  const LineModel model{.hotend = {.advance_s = kAdvance_s}};
  const planner::PlannedMove& move = moves_.front();
  double flow = 0.0;
  double first_mm = 0.0;
  double before_last_mm = 0.0;
  constexpr double kFine_s = 1e-6;
  for (double t = 0.0; t < move.duration_s(); t += kFine_s) {
    flow += kFine_s * (kPerMm * move.velocity_mm_s(t) - flow) / kAdvance_s;
    const double out_mm = kPerMm * move.distance_mm(t) - kAdvance_s * flow;
    first_mm = move.distance_mm(t) < 1.0 ? out_mm : first_mm;
    before_last_mm = move.distance_mm(t) < 59.0 ? out_mm : before_last_mm;
  }
  const double all_mm = 60.0 * kPerMm - kAdvance_s * flow;
  const LineStats without = laid(model, {});
  EXPECT_NEAR(without.first.mean, first_mm / kPerMm - 1.0, 0.01);
  EXPECT_NEAR(without.last.mean, (all_mm - before_last_mm) / kPerMm - 1.0, 0.03);
  EXPECT_DOUBLE_EQ(without.first.rms, std::abs(without.first.mean));
  const LineStats advanced = laid(model, {kAdvance_s, 0.0});
  EXPECT_NEAR(advanced.first.mean, 0.0, 0.01);
  EXPECT_NEAR(advanced.last.mean, 0.0, 0.01);
}

TEST_F(Straight, TellsHotendsThatAreNotAsAssumed) {
  const LineModel model{.hotend = {.advance_s = kAdvance_s}};
  const LineStats right = laid(model, {kAdvance_s, 0.0});
  // The firmware advances for a pressure that is 20 % too high, and too low.
  const LineStats less =
      laid(LineModel{.hotend = {.advance_s = 0.8 * kAdvance_s}}, {kAdvance_s, 0.0});
  const LineStats more =
      laid(LineModel{.hotend = {.advance_s = 1.2 * kAdvance_s}}, {kAdvance_s, 0.0});
  EXPECT_NEAR(right.other[0].rms, less.width.rms, 1e-9);
  EXPECT_NEAR(right.other[1].rms, more.width.rms, 1e-9);
  EXPECT_GT(right.other[0].rms, 10.0 * right.width.rms);
  LineModel late = model;
  late.hotend.dead_time_s = 2e-3;
  EXPECT_NEAR(right.other[3].rms, laid(late, {kAdvance_s, 0.0}).width.rms, 1e-9);
  EXPECT_NEAR(laid(late, {kAdvance_s, 0.0}).other[2].rms, right.width.rms, 1e-9);
}

// Klipper's smoothing delays nothing on the whole, but it rounds off what the advance does.
TEST_F(Straight, IsWorseWithASmoothedAdvance) {
  const LineModel model{.hotend = {.advance_s = kAdvance_s}};
  const LineStats smoothed = laid(model, {kAdvance_s, 0.04});
  const LineStats sharp = laid(model, {kAdvance_s, 0.0});
  EXPECT_GT(smoothed.width.rms, 10.0 * sharp.width.rms);
  EXPECT_LT(smoothed.width.rms, 0.1);
}

TEST_F(Straight, HasEdgesOffByTheContourErrorAndHalfTheWidthError) {
  const LineModel model{.hotend = {.advance_s = kAdvance_s}, .width_mm = 0.5};
  const LineStats stats = laid(model, {kAdvance_s, 0.0}, 1.1, 7e-3);
  EXPECT_NEAR(stats.width.rms, 0.1, 3e-3);
  EXPECT_NEAR(stats.edge.rms_mm, 7e-3 + 0.5 * 0.1 * 0.5, 1e-3);
  EXPECT_GE(stats.edge.max_mm, stats.edge.p99_mm);
}

TEST_F(Straight, IsNotMeasuredWhereNothingTellsThePressure) {
  EXPECT_EQ(laid(LineModel{}, {}).length_mm, 0.0);
}

}  // namespace
}  // namespace unflex::verify
