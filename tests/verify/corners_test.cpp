#include "unflex/verify/corners.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "plain_emitter.hpp"
#include "replaying.hpp"

namespace unflex::verify {
namespace {

using testing::plan_path;
using testing::Point;
using testing::verify_text;

constexpr double kReach_s = 0.03;

planner::Limits slow_corners() {
  planner::Limits limits;
  limits.max_accel_mm_s2 = 1e6;
  return limits;
}

CornerGauge gauge_on(const std::vector<Point>& points) {
  CornerGauge gauge(kReach_s);
  double start_s = 0.0;
  for (const planner::PlannedMove& move : plan_path(points, slow_corners())) {
    gauge.follow(move, start_s, start_s + move.duration_s());
    start_s += move.duration_s();
  }
  return gauge;
}

// 10 mm along X and 10 mm in another direction, 0.1 s each.
std::vector<Point> bent_by(double degrees) {
  const double angle = degrees * std::numbers::pi / 180.0;
  return {{0.0, 0.0, 100.0},
          {10.0, 0.0, 100.0, 1.0},
          {10.0 + 10.0 * std::cos(angle), 10.0 * std::sin(angle), 100.0, 1.0}};
}

// Moves at 100 mm/s along the path with the corner at (10, 0), rounded with this radius.
void round_the_corner(CornerGauge& gauge, double radius_mm) {
  const double begin_mm = 10.0 - radius_mm;
  const double length_mm = 0.5 * std::numbers::pi * radius_mm;
  for (double way_mm = 0.0; way_mm < 20.0; way_mm += 0.01) {
    const double beyond_mm = way_mm - begin_mm;
    if (beyond_mm <= 0.0) {
      gauge.sample(0.01 * way_mm, {way_mm, 0.0});
    } else if (beyond_mm < length_mm) {
      const double angle = beyond_mm / radius_mm;
      gauge.sample(0.01 * way_mm,
                   {begin_mm + radius_mm * std::sin(angle), radius_mm * (1.0 - std::cos(angle))});
    } else {
      gauge.sample(0.01 * way_mm, {10.0, radius_mm + beyond_mm - length_mm});
    }
  }
}

TEST(CornerAccumulator, CountsEveryCornerAlike) {
  EXPECT_EQ(CornerAccumulator{}.stats().count, 0U);
  EXPECT_EQ(CornerAccumulator{}.stats().rms_mm, 0.0);
  CornerAccumulator accumulator;
  accumulator.add(0.03 * 0.03, 7);
  accumulator.add(0.04 * 0.04, 9);
  const CornerStats stats = accumulator.stats();
  EXPECT_EQ(stats.count, 2U);
  EXPECT_DOUBLE_EQ(stats.rms_mm, 0.05 / std::sqrt(2.0));
  EXPECT_DOUBLE_EQ(stats.max_mm, 0.04);
  EXPECT_NEAR(stats.p99_mm, 0.04, 0.0004);
  EXPECT_EQ(stats.max_line, 9U);
}

TEST(CornerGauge, MeasuresHowFarAnArcPassesFromTheCorner) {
  for (const double radius_mm : {0.1, 0.5, 1.0}) {
    CornerGauge gauge = gauge_on(bent_by(90.0));
    round_the_corner(gauge, radius_mm);
    const CornerStats stats = gauge.stats();
    EXPECT_EQ(stats.count, 1U);
    EXPECT_NEAR(stats.max_mm, (std::numbers::sqrt2 - 1.0) * radius_mm, 2e-4);
    EXPECT_DOUBLE_EQ(stats.rms_mm, stats.max_mm);
    EXPECT_EQ(stats.max_line, 1U);
  }
}

TEST(CornerGauge, FindsNoDistanceOnThePath) {
  CornerGauge gauge = gauge_on(bent_by(90.0));
  for (int i = 0; i <= 200; ++i) {
    gauge.sample(1e-3 * i, {std::min(0.1 * i, 10.0), std::max(0.1 * i - 10.0, 0.0)});
  }
  EXPECT_EQ(gauge.stats().count, 1U);
  EXPECT_NEAR(gauge.stats().max_mm, 0.0, 1e-12);
}

TEST(CornerGauge, LooksBetweenTheSamples) {
  CornerGauge gauge = gauge_on(bent_by(90.0));
  gauge.sample(0.095, {9.0, 0.3});
  gauge.sample(0.105, {11.0, 0.3});
  EXPECT_DOUBLE_EQ(gauge.stats().max_mm, 0.3);
  CornerGauge lifted = gauge_on(bent_by(90.0));
  lifted.sample(0.095, {9.6, 0.3});
  lifted.lift();
  lifted.sample(0.105, {11.0, 0.3});
  EXPECT_DOUBLE_EQ(lifted.stats().max_mm, 0.5);
}

TEST(CornerGauge, LooksOnlyNearTheTimeOfTheCorner) {
  CornerGauge gauge = gauge_on(bent_by(90.0));
  gauge.sample(0.06, {10.0, 0.0});
  gauge.sample(0.08, {9.0, 0.0});
  gauge.sample(0.12, {10.0, 1.0});
  gauge.sample(0.14, {10.0, 0.0});
  EXPECT_NEAR(gauge.stats().max_mm, std::sqrt(0.5), 1e-12);
  CornerGauge unseen = gauge_on(bent_by(90.0));
  unseen.sample(0.01, {1.0, 0.0});
  unseen.sample(0.19, {10.0, 9.0});
  EXPECT_EQ(unseen.stats().count, 0U);
}

// The corner is reached at 0.1 s. Half of its time is not looked at, so nothing is known of it.
TEST(CornerGauge, CountsNoCornerThatItMissed) {
  CornerGauge missing = gauge_on(bent_by(90.0));
  for (double time_s = 0.0; time_s < 0.095; time_s += 1e-3) {
    missing.sample(time_s, {100.0 * time_s, 0.0});
  }
  missing.miss(0.095);
  missing.miss(0.11);
  missing.sample(0.2, {10.0, 10.0});
  EXPECT_EQ(missing.stats().count, 0U);
  // Not to look far from a corner costs nothing.
  CornerGauge seeing = gauge_on(bent_by(90.0));
  seeing.miss(0.05);
  for (double time_s = 0.06; time_s < 0.2; time_s += 1e-3) {
    seeing.sample(time_s, {std::min(100.0 * time_s, 10.0), std::max(0.0, 100.0 * time_s - 10.0)});
  }
  seeing.miss(0.2);
  EXPECT_EQ(seeing.stats().count, 1U);
}

TEST(CornerGauge, TakesOnlySharpTurnsForCorners) {
  for (const auto& [degrees, corners] :
       {std::pair{15.0, 0U}, std::pair{19.9, 0U}, std::pair{20.1, 1U}, std::pair{-25.0, 1U},
        std::pair{180.0, 1U}}) {
    CornerGauge gauge = gauge_on(bent_by(degrees));
    gauge.sample(0.1, {10.0, 0.0});
    EXPECT_EQ(gauge.stats().count, corners) << degrees;
  }
}

TEST(CornerGauge, SeesNoCornerInADenseCurve) {
  std::vector<Point> circle;
  for (int i = 0; i <= 360; ++i) {
    const double angle = i * std::numbers::pi / 180.0;
    circle.push_back({10.0 * std::cos(angle), 10.0 * std::sin(angle), 100.0, 0.01});
  }
  CornerGauge gauge = gauge_on(circle);
  for (int i = 0; i < 1000; ++i) {
    gauge.sample(1e-3 * i, {10.0, 0.0});
  }
  EXPECT_EQ(gauge.stats().count, 0U);
}

TEST(CornerGauge, TakesATravelForNoPartOfACorner) {
  std::vector<Point> points = bent_by(90.0);
  points[2].filament_mm = 0.0;
  CornerGauge before_travel = gauge_on(points);
  before_travel.sample(0.1, {10.0, 0.0});
  EXPECT_EQ(before_travel.stats().count, 0U);
  points = bent_by(90.0);
  points[1].filament_mm = 0.0;
  CornerGauge behind_travel = gauge_on(points);
  behind_travel.sample(0.1, {10.0, 0.0});
  EXPECT_EQ(behind_travel.stats().count, 0U);
}

// ---- in whole files ----------------------------------------------------------------------------

constexpr char kBegin[] = "G28\nG90\nM83\nG1 Z0.3 F600\nG1 X20 Y20 F6000\nG1 F3600\n";

TEST(Corners, ThatTheNozzleStopsInCountToo) {
  const std::string there = std::string(kBegin) + "G1 X60 Y20 E1.2\n";
  const std::string on = "G1 X60 Y50 E0.9\n";
  Rules rules;
  rules.nozzle.x = rules.nozzle.y = dynamics::from_frequency(45.0, 0.1);
  for (const std::string stop :
       {"", "G4 P500\n", "G1 E-2 F1800\nG1 E2\nG1 F3600\n", "M400\n", "G1 Z1\nG1 Z0.3\n"}) {
    const std::string text = there + stop + on;
    const VerifyReport report = verify_text(text, text, rules);
    EXPECT_EQ(report.measured.uncompensated.corners.count, 1U) << stop;
    EXPECT_EQ(report.measured.uncompensated.corners.max_line, 7U) << stop;
    EXPECT_EQ(report.measured.compensated.corners.count, 1U) << stop;
    EXPECT_DOUBLE_EQ(report.measured.compensated.corners.max_mm,
                     report.measured.uncompensated.corners.max_mm);
    // A nozzle that rests at the corner does not cut it.
    EXPECT_LT(report.measured.uncompensated.corners.max_mm, stop.empty() ? 0.1 : 0.01) << stop;
  }
}

TEST(Corners, AreTheSameInRunsThatAreDrawnInShortLines) {
  const std::string print = std::string(kBegin) +
                            "G1 X60 Y20 E1.2\n"
                            "G1 X60 Y50 E0.9\n"
                            "G4 P200\n"
                            "G1 X20 Y50 E1.2\n"
                            "G1 E-2 F1800\n"
                            "G1 E2\n"
                            "G1 X20 Y20.5 E0.88 F3600\n"
                            "G1 X22 Y20.5 E-0.4\n"
                            "G1 X30 Y30 F9000\n"
                            "G1 X50 Y40 E0.7 F3600\n"
                            "G1 X70 Y45 E0.7\n"
                            "G1 X50 Y41 E0.7\n";
  const VerifyReport report = verify_text(print, testing::PlainEmitter().emit(print));
  EXPECT_EQ(testing::violations_of(report), "");
  EXPECT_GT(report.runs, 1U);
  EXPECT_EQ(report.measured.uncompensated.corners.count, 4U);
  EXPECT_EQ(report.measured.compensated.corners.count, 4U);
  EXPECT_NEAR(report.measured.compensated.corners.rms_mm,
              report.measured.uncompensated.corners.rms_mm, 0.01);
}

}  // namespace
}  // namespace unflex::verify
