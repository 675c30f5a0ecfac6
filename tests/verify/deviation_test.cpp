#include "unflex/verify/deviation.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "replaying.hpp"

namespace unflex::verify {
namespace {

using testing::at_rest;
using testing::plan_path;

planner::Limits limits_with(double accel_mm_s2, double corner_mm_s) {
  planner::Limits limits;
  limits.max_velocity_mm_s = 1000.0;
  limits.max_accel_mm_s2 = accel_mm_s2;
  limits.square_corner_velocity_mm_s = corner_mm_s;
  limits.minimum_cruise_ratio = 0.0;
  return limits;
}

NozzleModel model_with(double omega, double zeta) {
  NozzleModel model;
  model.x = {omega, zeta};
  model.y = {omega, zeta};
  return model;
}

std::vector<planner::PlannedMove> shifted(std::vector<planner::PlannedMove> moves, double dx,
                                          double dy) {
  for (planner::PlannedMove& move : moves) {
    for (gcode::Position* position : {&move.segment.start_mm, &move.segment.end_mm}) {
      (*position)[gcode::X] += dx;
      (*position)[gcode::Y] += dy;
    }
  }
  return moves;
}

// ---- the statistics ----------------------------------------------------------------------------

TEST(DeviationAccumulator, OfNothingIsZero) {
  const DeviationStats stats = DeviationAccumulator{}.stats();
  EXPECT_EQ(stats.contour_max_mm, 0.0);
  EXPECT_EQ(stats.contour_p99_mm, 0.0);
  EXPECT_EQ(stats.contour_rms_mm, 0.0);
  EXPECT_EQ(stats.duration_s, 0.0);
}

TEST(DeviationAccumulator, WeightsSamplesByTheirTime) {
  DeviationAccumulator accumulator;
  accumulator.add(0.001 * 0.001, 0.002 * 0.002, 3.0, 7);
  accumulator.add(0.003 * 0.003, 0.004 * 0.004, 1.0, 9);
  const DeviationStats stats = accumulator.stats();
  EXPECT_DOUBLE_EQ(stats.contour_max_mm, 0.003);
  EXPECT_DOUBLE_EQ(stats.contour_rms_mm, std::sqrt((3.0 * 1e-6 + 9e-6) / 4.0));
  EXPECT_DOUBLE_EQ(stats.tracking_max_mm, 0.004);
  EXPECT_DOUBLE_EQ(stats.tracking_rms_mm, std::sqrt((3.0 * 4e-6 + 16e-6) / 4.0));
  EXPECT_DOUBLE_EQ(stats.duration_s, 4.0);
  EXPECT_EQ(stats.contour_max_line, 9U);
}

TEST(DeviationAccumulator, FindsThe99thPercentileWithinAPercent) {
  std::mt19937_64 random(11);
  std::exponential_distribution<double> exponential(1000.0);
  DeviationAccumulator accumulator;
  for (int i = 0; i < 200000; ++i) {
    const double error = exponential(random);
    accumulator.add(error * error, 0.0, 1e-4, 1);
  }
  // P(e > q) = exp(−1000 q) = 0.01; the sample of this size spreads by half a percent.
  EXPECT_NEAR(accumulator.stats().contour_p99_mm, std::log(100.0) / 1000.0, 5e-5);
}

TEST(DeviationAccumulator, The99thPercentileIsNeverAboveTheMaximum) {
  DeviationAccumulator accumulator;
  accumulator.add(0.00512 * 0.00512, 0.0, 1.0, 1);
  const DeviationStats stats = accumulator.stats();
  EXPECT_LE(stats.contour_p99_mm, stats.contour_max_mm);
  EXPECT_NEAR(stats.contour_p99_mm, 0.00512, 0.006 * 0.00512);
}

// ---- the thesis' corner ------------------------------------------------------------------------

struct CornerCase {
  std::string name;
  double omega = 100.0;
  double zeta = 0.5;
  double accel_mm_s2 = 5000.0;
  double velocity_mm_s = 100.0;
  double contour_max_um = 0.0;
};

class ThesisCorner : public ::testing::TestWithParam<CornerCase> {
 protected:
  static std::vector<planner::PlannedMove> plan(const CornerCase& c) {
    return plan_path(
        {{0.0, 0.0, 0.0}, {10.0, 0.0, c.velocity_mm_s, 0.3}, {10.0, 10.0, c.velocity_mm_s, 0.3}},
        limits_with(c.accel_mm_s2, 0.0));
  }
};

TEST_P(ThesisCorner, IsMissedAsFarAsPublished) {
  const CornerCase& c = GetParam();
  const auto moves = plan(c);
  const RunDeviation run = measure(moves, moves, at_rest(moves), model_with(c.omega, c.zeta));
  EXPECT_NEAR(1e3 * run.extruding.stats().contour_max_mm, c.contour_max_um,
              0.01 * c.contour_max_um);
  EXPECT_NEAR(run.all.stats().duration_s, duration_s(moves), 1e-9);
}

INSTANTIATE_TEST_SUITE_P(
    Cases, ThesisCorner,
    ::testing::Values(CornerCase{"reference", 100.0, 0.5, 5000.0, 100.0, 464.0},
                      CornerCase{"softer", 50.0, 0.5, 5000.0, 100.0, 1130.0},
                      CornerCase{"stiffer", 200.0, 0.5, 5000.0, 100.0, 144.0},
                      CornerCase{"undamped", 100.0, 0.0, 5000.0, 100.0, 1881.0},
                      CornerCase{"critical", 100.0, 1.0, 5000.0, 100.0, 316.0},
                      CornerCase{"gentler", 100.0, 0.5, 1000.0, 100.0, 100.0},
                      CornerCase{"harder", 100.0, 0.5, 10000.0, 100.0, 525.0},
                      CornerCase{"slower", 100.0, 0.5, 5000.0, 50.0, 262.0},
                      CornerCase{"faster", 100.0, 0.5, 5000.0, 200.0, 623.0}),
    [](const auto& tested) { return tested.param.name; });

// ---- the meter ---------------------------------------------------------------------------------

TEST(Measure, OnAStraightLineTheNozzleIsLateOrEarlyButOnThePath) {
  const auto moves =
      plan_path({{0.0, 0.0, 0.0}, {50.0, 0.0, 100.0}, {70.0, 0.0, 50.0, 1.0}, {99.0, 0.0, 50.0}},
                limits_with(1e4, 5.0));
  const DeviationStats stats = measure(moves, moves, at_rest(moves), {}).extruding.stats();
  const double omega = NozzleModel{}.x.main().omega_rad_s;
  // Braking from 100 to 50 mm/s throws the nozzle forward by a/ω², and it swings on from there.
  EXPECT_GT(stats.tracking_max_mm, 0.5 * 1e4 / (omega * omega));
  EXPECT_LT(stats.contour_max_mm, 1e-12);
}

TEST(Measure, HalvingTheStepChangesNothingThatMatters) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> uniform(0.0, 30.0);
  std::vector<testing::Point> points = {{0.0, 0.0, 0.0}};
  for (int i = 0; i < 40; ++i) {
    points.push_back({uniform(random), uniform(random), 150.0, 0.5});
  }
  const auto moves = plan_path(points, limits_with(5000.0, 5.0));
  NozzleModel coarse;
  NozzleModel fine;
  fine.step_s = 0.5 * coarse.step_s;
  const DeviationStats a = measure(moves, moves, at_rest(moves), coarse).extruding.stats();
  const DeviationStats b = measure(moves, moves, at_rest(moves), fine).extruding.stats();
  EXPECT_NEAR(a.contour_max_mm, b.contour_max_mm, 1e-3 * b.contour_max_mm);
  EXPECT_NEAR(a.contour_rms_mm, b.contour_rms_mm, 1e-3 * b.contour_rms_mm);
  EXPECT_NEAR(a.tracking_rms_mm, b.tracking_rms_mm, 1e-3 * b.tracking_rms_mm);
  EXPECT_NEAR(a.duration_s, b.duration_s, 1e-9);
}

// The nozzle comes to rest on the base in the long sides, where samples are far apart. What happens
// at the corner is that of short sides, and a base that is off counts over the whole side.
TEST(Measure, LongCruisesChangeNothingThatMatters) {
  const auto corner = [](double side_mm, double speed_mm_s) {
    return plan_path(
        {{0.0, 0.0, 0.0}, {side_mm, 0.0, speed_mm_s, 0.3}, {side_mm, side_mm, speed_mm_s, 0.3}},
        limits_with(5000.0, 5.0));
  };
  const NozzleModel model = model_with(280.0, 0.06);
  const auto long_sides = corner(200.0, 20.0);
  const DeviationStats slow =
      measure(long_sides, long_sides, at_rest(long_sides), model).extruding.stats();
  const auto short_sides = corner(15.0, 20.0);
  const DeviationStats quick =
      measure(short_sides, short_sides, at_rest(short_sides), model).extruding.stats();
  EXPECT_NEAR(slow.contour_max_mm, quick.contour_max_mm, 1e-6);
  EXPECT_NEAR(slow.contour_rms_mm * std::sqrt(slow.duration_s),
              quick.contour_rms_mm * std::sqrt(quick.duration_s), 1e-6);
  EXPECT_NEAR(slow.duration_s, planner::duration_s(long_sides), 1e-9);
  const auto beside = shifted(long_sides, 0.0, 0.02);
  const DeviationStats off = measure(long_sides, beside, at_rest(beside), model).extruding.stats();
  EXPECT_NEAR(off.contour_rms_mm, 0.02 / std::sqrt(2.0), 3e-4);
}

TEST(Measure, AStiffAxisDrawsThePath) {
  const auto moves = plan_path({{0.0, 0.0, 0.0}, {10.0, 0.0, 100.0, 0.3}, {10.0, 10.0, 100.0, 0.3}},
                               limits_with(5000.0, 5.0));
  const RunDeviation run = measure(moves, moves, at_rest(moves), model_with(2e4, 1.0));
  EXPECT_LT(run.all.stats().contour_max_mm, 2e-4);
  EXPECT_LT(run.all.stats().tracking_max_mm, 5e-4);
}

TEST(Measure, AShiftedBaseIsOffByTheShift) {
  const auto moves = plan_path({{0.0, 0.0, 0.0}, {50.0, 0.0, 20.0, 1.0}}, limits_with(5000.0, 5.0));
  const auto base = shifted(moves, 0.0, 0.25);
  const RunDeviation run = measure(moves, base, at_rest(base), model_with(2e4, 1.0));
  const DeviationStats stats = run.all.stats();
  EXPECT_NEAR(stats.contour_max_mm, 0.25, 1e-7);
  EXPECT_NEAR(stats.contour_rms_mm, 0.25, 1e-9);
  EXPECT_NEAR(run.base_end_mm.y, 0.25, 1e-12);
}

TEST(Measure, IsTheSameAnywhereOnTheBed) {
  const auto moves = plan_path({{0.0, 0.0, 0.0}, {10.0, 0.0, 100.0, 0.3}, {4.0, 9.0, 80.0, 0.3}},
                               limits_with(5000.0, 5.0));
  const auto there = shifted(moves, 117.5, -63.25);
  const DeviationStats a = measure(moves, moves, at_rest(moves), {}).all.stats();
  const DeviationStats b = measure(there, there, at_rest(there), {}).all.stats();
  EXPECT_NEAR(a.contour_max_mm, b.contour_max_mm, 1e-10);
  EXPECT_NEAR(a.contour_rms_mm, b.contour_rms_mm, 1e-10);
  EXPECT_NEAR(a.tracking_rms_mm, b.tracking_rms_mm, 1e-10);
}

TEST(Measure, ABranchNearByIsNotTakenForThePath) {
  // Out along y = 0, back along y = 0.2. A base that is wrongly at y = 0.2 on the way out is 0.2 mm
  // off, although the sliced path passes there a second later.
  const auto moves = plan_path(
      {{0.0, 0.0, 0.0}, {50.0, 0.0, 50.0, 1.0}, {50.0, 0.2, 50.0, 0.01}, {0.0, 0.2, 50.0, 1.0}},
      limits_with(5000.0, 5.0));
  auto base = moves;
  base[0] = shifted({moves[0]}, 0.0, 0.2)[0];
  const RunDeviation run = measure(moves, base, at_rest(base), model_with(2e4, 1.0));
  EXPECT_NEAR(run.extruding.stats().contour_max_mm, 0.2, 1e-3);
  EXPECT_NEAR(run.extruding.stats().contour_rms_mm, 0.2 / std::sqrt(2.0), 2e-3);
}

TEST(Measure, TravelCountsInAllOnly) {
  const auto moves = plan_path({{0.0, 0.0, 0.0}, {20.0, 0.0, 100.0}, {20.0, 20.0, 100.0, 0.7}},
                               limits_with(5000.0, 0.0));
  const RunDeviation run = measure(moves, moves, at_rest(moves), {});
  EXPECT_NEAR(run.extruding.stats().duration_s, moves[1].duration_s(), 1e-9);
  EXPECT_NEAR(run.all.stats().duration_s, duration_s(moves), 1e-9);
}

TEST(Measure, ATailCountsInNeither) {
  const auto moves =
      plan_path({{0.0, 0.0, 0.0}, {20.0, 0.0, 100.0, 0.7}}, limits_with(5000.0, 5.0));
  auto longer = moves;
  const auto tail = plan_path({{20.0, 0.0, 0.0}, {25.0, 0.0, 10.0}}, limits_with(5000.0, 5.0));
  longer.push_back(tail.front());
  const RunDeviation with = measure(moves, longer, at_rest(moves), {});
  const RunDeviation without = measure(moves, moves, at_rest(moves), {});
  EXPECT_NEAR(with.all.stats().duration_s, duration_s(moves), 1e-9);
  EXPECT_NEAR(with.all.stats().contour_rms_mm, without.all.stats().contour_rms_mm, 1e-12);
  EXPECT_DOUBLE_EQ(with.base_end_mm.x, 25.0);
}

TEST(Measure, ABaseThatEndsEarlyRestsWhileTheReferenceGoesOn) {
  const auto moves = plan_path({{0.0, 0.0, 0.0}, {10.0, 0.0, 50.0, 0.3}, {10.0, 10.0, 50.0, 0.3}},
                               limits_with(5000.0, 0.0));
  const std::vector<planner::PlannedMove> half(moves.begin(), moves.begin() + 1);
  const RunDeviation run = measure(moves, half, at_rest(moves), {});
  const DeviationStats stats = run.all.stats();
  EXPECT_NEAR(stats.duration_s, duration_s(moves), 1e-9);
  EXPECT_NEAR(stats.tracking_max_mm, 10.0, 0.01);
  // run.end is the nozzle at the end of the base's own motion, still swinging.
  EXPECT_GT(std::abs(run.end.x.velocity()), 0.1);
}

// Whether a moment counts as extruding is told by what is played, not by the reference.
TEST(Measure, CountsAsExtrudingWhileTheBaseLaysFilament) {
  const auto limits = limits_with(5000.0, 5.0);
  const auto reference = plan_path(
      {{0.0, 0.0, 0.0}, {10.0, 0.0, 50.0}, {10.0, 10.0, 50.0, 0.3}, {20.0, 10.0, 50.0}}, limits);
  auto base = reference;
  base[0].segment.end_mm[gcode::E] += 0.0005;
  base[1].segment.end_mm[gcode::E] = base[1].segment.start_mm[gcode::E];
  const RunDeviation run = measure(reference, base, at_rest(base), {});
  EXPECT_NEAR(run.extruding.stats().duration_s, base[0].duration_s(), 1e-9);
  EXPECT_EQ(run.extruding.stats().contour_max_line, 1U);
  const RunDeviation sliced = measure(reference, reference, at_rest(base), {});
  EXPECT_NEAR(sliced.extruding.stats().duration_s, reference[1].duration_s(), 1e-9);
  EXPECT_NEAR(run.all.stats().contour_rms_mm, sliced.all.stats().contour_rms_mm, 1e-12);
}

// Filament after the reference's end is laid as well: 0.1 s beside the end of the path.
TEST(Measure, CountsFilamentThatIsLaidAfterTheReferenceHasEnded) {
  const auto limits = limits_with(5000.0, 5.0);
  const auto reference = plan_path({{0.0, 0.0, 0.0}, {10.0, 0.0, 50.0}}, limits);
  auto base = reference;
  const auto late = plan_path({{10.0, 0.0, 0.0}, {10.0, 4.0, 50.0, 0.1}}, limits);
  base.insert(base.end(), late.begin(), late.end());
  const RunDeviation run = measure(reference, base, at_rest(base), model_with(2e4, 1.0));
  EXPECT_NEAR(run.extruding.stats().duration_s, late.front().duration_s(), 1e-9);
  EXPECT_NEAR(run.extruding.stats().contour_max_mm, 4.0, 0.01);
  EXPECT_NEAR(run.all.stats().duration_s, duration_s(reference), 1e-9);
}

// The nozzle's equation of motion, by RK4 with the frequency of the base's place at each stage.
TEST(Measure, HasTheFrequencyOfTheBasesPlace) {
  const auto moves = plan_path({{0.0, 0.0, 0.0}, {100.0, 0.0, 200.0}}, limits_with(5000.0, 5.0));
  const double omega = 280.0;
  const double zeta = 0.05;
  MachineChange change;
  change.axes.x.maps = {{gcode::X, {0.0, 100.0}, {1.1, 0.7}}};
  const RunDeviation run = measure(moves, moves, at_rest(moves), model_with(omega, zeta), change);
  constexpr double kStep_s = 2e-5;
  const planner::PlannedMove& move = moves.front();
  double p = 0.0;
  double v = 0.0;
  const auto rate = [&](double t, double place, double velocity) {
    const double b = move.position_mm(t)[gcode::X];
    const double w = omega * (1.1 - 0.4 * b / 100.0);
    return 2.0 * zeta * w * (move.velocity_mm_s(t) - velocity) + w * w * (b - place);
  };
  const double steps = std::floor(move.duration_s() / kStep_s);
  const double h = move.duration_s() / steps;
  double largest_mm = 0.0;
  for (double i = 0.0; i < steps; i += 1.0) {
    const double t = i * h;
    const double v1 = v;
    const double a1 = rate(t, p, v1);
    const double v2 = v + 0.5 * h * a1;
    const double a2 = rate(t + 0.5 * h, p + 0.5 * h * v1, v2);
    const double v3 = v + 0.5 * h * a2;
    const double a3 = rate(t + 0.5 * h, p + 0.5 * h * v2, v3);
    const double v4 = v + h * a3;
    const double a4 = rate(t + h, p + h * v3, v4);
    p += h / 6.0 * (v1 + 2.0 * v2 + 2.0 * v3 + v4);
    v += h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
    largest_mm = std::max(largest_mm, std::abs(p - move.position_mm(t + h)[gcode::X]));
  }
  EXPECT_NEAR(run.all.stats().tracking_max_mm, largest_mm, 2e-3 * largest_mm);
  EXPECT_NEAR(run.end.x.position(), p, 2e-3 * largest_mm);
  EXPECT_NEAR(run.end.x.velocity(), v, 2e-3 * largest_mm * omega);
  // Ignoring the map gives another motion.
  const RunDeviation even = measure(moves, moves, at_rest(moves), model_with(omega, zeta));
  EXPECT_GT(std::abs(even.end.x.position() - p), 0.1 * largest_mm);
}

TEST(Measure, CarriesTheNozzleFromOneRunToTheNext) {
  const std::vector<testing::Point> points = {
      {0.0, 0.0, 0.0}, {10.0, 0.0, 100.0, 0.3}, {10.0, 10.0, 100.0, 0.3}, {0.0, 10.0, 80.0, 0.3}};
  const auto moves = plan_path(points, limits_with(5000.0, 0.0));
  const RunDeviation whole = measure(moves, moves, at_rest(moves), {});
  NozzleXY nozzle = at_rest(moves);
  for (const planner::PlannedMove& move : moves) {
    nozzle = measure({move}, {move}, nozzle, {}).end;
  }
  EXPECT_NEAR(nozzle.x.position(), whole.end.x.position(), 1e-12);
  EXPECT_NEAR(nozzle.x.velocity(), whole.end.x.velocity(), 1e-9);
  EXPECT_NEAR(nozzle.y.position(), whole.end.y.position(), 1e-12);
  EXPECT_NEAR(nozzle.y.velocity(), whole.end.y.velocity(), 1e-9);
}

TEST(Measure, OnACircleTheNozzleRunsOutside) {
  // Many more pieces than are kept at a time, so that old ones are dropped on the way. Filament is
  // laid after the swing of the start has died down and before that of the end begins. It is so
  // little that the extruder does not slow the junctions down.
  std::vector<testing::Point> points = {{0.0, 0.0, 0.0}};
  for (int i = 1; i <= 20000; ++i) {
    const double angle = 0.005 * i;
    const double filament = i > 1000 && i < 19900 ? 0.0005 : 0.0;
    points.push_back({20.0 * std::sin(angle), 20.0 - 20.0 * std::cos(angle), 60.0, filament});
  }
  const auto moves = plan_path(points, limits_with(5000.0, 5.0));
  const DeviationStats stats = measure(moves, moves, at_rest(moves), {}).extruding.stats();
  // At radius R and speed v the nozzle is outside by v²/(Rω²), to first order in v/(Rω).
  const double omega = NozzleModel{}.x.main().omega_rad_s;
  const double outside_mm = 60.0 * 60.0 / (20.0 * omega * omega);
  EXPECT_NEAR(stats.contour_rms_mm, outside_mm, 0.03 * outside_mm);
  EXPECT_NEAR(stats.contour_max_mm, outside_mm, 0.1 * outside_mm);
}

TEST(Measure, OfNothingIsNothing) {
  const RunDeviation run = measure({}, {}, {{1.0, 0.0}, {2.0, 0.0}}, {});
  EXPECT_EQ(run.all.stats().duration_s, 0.0);
  EXPECT_EQ(run.end.x.position(), 1.0);
}

}  // namespace
}  // namespace unflex::verify
