// Properties of plans of random programs.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <variant>
#include <vector>

#include "planner/plan_helpers.hpp"
#include "unflex/planner/klipper_planner.hpp"

namespace unflex::planner {
namespace {

struct Stop {};
using Step = std::variant<gcode::Segment, gcode::LimitChange, Stop>;

struct Style {
  bool extruder_alone = true;
  bool changes_cruise_ratio = true;
  bool wipes = true;  // retractions during moves
};

// Paths like sliced ones: stretches of small turns, corners, reversals, hops and extrusion.
class ProgramMaker {
 public:
  ProgramMaker(unsigned seed, Style style) : random_(seed), style_(style) {}

  std::vector<Step> make(int steps) {
    std::vector<Step> program;
    for (int i = 0; i < steps; ++i) program.push_back(next());
    return program;
  }

 private:
  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  bool chance(double probability) { return uniform(0.0, 1.0) < probability; }

  Step next() {
    if (chance(0.002)) return Stop{};
    if (chance(0.03)) return limit_change();
    if (chance(0.05)) mode_ = std::exp(uniform(-6.0, 3.0));
    if (chance(0.05)) feed_ = std::exp(uniform(1.0, 6.0));
    if (chance(0.05)) e_per_mm_ = chance(0.3) ? 0.0 : uniform(0.02, 0.06);
    return move();
  }

  Step limit_change() {
    gcode::LimitChange change;
    change.max_accel_mm_s2 = std::exp(uniform(4.0, 9.5));
    if (chance(0.3)) change.max_velocity_mm_s = uniform(20.0, 400.0);
    if (chance(0.3)) change.square_corner_velocity_mm_s = uniform(0.5, 20.0);
    if (style_.changes_cruise_ratio && chance(0.3)) {
      change.minimum_cruise_ratio = uniform(0.0, 0.95);
    }
    return change;
  }

  Step move() {
    gcode::Position to = at_;
    if (style_.extruder_alone && chance(0.02)) {
      to[gcode::E] += uniform(-2.0, 2.0);
    } else {
      heading_ += chance(0.1) ? uniform(-std::numbers::pi, std::numbers::pi) : uniform(-0.1, 0.1);
      const double length = mode_ * uniform(0.5, 1.5);
      to[gcode::X] += length * std::cos(heading_);
      to[gcode::Y] += length * std::sin(heading_);
      if (chance(0.02)) to[gcode::Z] += uniform(-1.0, 1.0) * length;
      const bool wipe = style_.wipes && chance(0.02);
      to[gcode::E] += length * (wipe ? -uniform(0.01, 1.0) : e_per_mm_);
    }
    const gcode::Segment result = testing::segment(at_, to, feed_);
    at_ = to;
    return result;
  }

  std::mt19937_64 random_;
  Style style_;
  gcode::Position at_{};
  double heading_ = 0.0;
  double mode_ = 0.5;
  double feed_ = 100.0;
  double e_per_mm_ = 0.04;
};

Limits scaled(Limits limits, double factor) {
  limits.max_velocity_mm_s *= factor;
  limits.max_accel_mm_s2 *= factor * factor;
  limits.square_corner_velocity_mm_s *= factor;
  return limits;
}

FirmwareConfig scaled(FirmwareConfig fixed, double factor) {
  fixed.max_z_velocity_mm_s *= factor;
  fixed.max_z_accel_mm_s2 *= factor * factor;
  fixed.max_extrude_only_velocity_mm_s *= factor;
  fixed.max_extrude_only_accel_mm_s2 *= factor * factor;
  fixed.instantaneous_corner_velocity_mm_s *= factor;
  return fixed;
}

gcode::LimitChange scaled(gcode::LimitChange change, double factor) {
  if (change.max_velocity_mm_s) *change.max_velocity_mm_s *= factor;
  if (change.max_accel_mm_s2) *change.max_accel_mm_s2 *= factor * factor;
  if (change.square_corner_velocity_mm_s) *change.square_corner_velocity_mm_s *= factor;
  return change;
}

enum class Taking { always, at_stops, at_the_end };

// The plan with all speeds `factor` times as high and all accelerations factor² times.
std::vector<PlannedMove> run(const std::vector<Step>& program, Taking taking, double factor = 1.0) {
  FirmwareConfig slow_z;
  slow_z.max_z_velocity_mm_s = 15.0;
  slow_z.max_z_accel_mm_s2 = 150.0;
  KlipperPlanner planner(scaled(Limits{}, factor), scaled(slow_z, factor));
  std::vector<PlannedMove> result;
  for (const Step& step : program) {
    if (const auto* segment = std::get_if<gcode::Segment>(&step)) {
      gcode::Segment faster = *segment;
      faster.feed_mm_s *= factor;
      planner.add(faster);
    } else if (const auto* change = std::get_if<gcode::LimitChange>(&step)) {
      planner.apply(scaled(*change, factor));
    } else {
      planner.stop();
      if (taking == Taking::at_stops) planner.take(result);
    }
    if (taking == Taking::always) planner.take(result);
  }
  planner.stop();
  planner.take(result);
  return result;
}

void expect_same(const PlannedMove& a, const PlannedMove& b, std::size_t i) {
  ASSERT_EQ(a.start_v_mm_s, b.start_v_mm_s) << i;
  ASSERT_EQ(a.cruise_v_mm_s, b.cruise_v_mm_s) << i;
  ASSERT_EQ(a.end_v_mm_s, b.end_v_mm_s) << i;
  ASSERT_EQ(a.accel_s, b.accel_s) << i;
  ASSERT_EQ(a.cruise_s, b.cruise_s) << i;
  ASSERT_EQ(a.decel_s, b.decel_s) << i;
  ASSERT_EQ(a.accel_mm_s2, b.accel_mm_s2) << i;
  ASSERT_EQ(a.length_mm, b.length_mm) << i;
}

TEST(PlannerProperty, ThePlanDoesNotDependOnWhenMovesAreTaken) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const auto program = ProgramMaker(seed, {}).make(3000);
    const auto always = run(program, Taking::always);
    const auto at_stops = run(program, Taking::at_stops);
    const auto at_the_end = run(program, Taking::at_the_end);
    ASSERT_EQ(always.size(), at_stops.size());
    ASSERT_EQ(always.size(), at_the_end.size());
    for (std::size_t i = 0; i < always.size(); ++i) {
      expect_same(always[i], at_stops[i], i);
      expect_same(always[i], at_the_end[i], i);
    }
  }
}

// With speeds 2^20 times as high the whole program lasts less than the interval of lazy planning,
// so every stretch is planned at once; and factors of two scale without rounding.
TEST(PlannerProperty, PlanningLazilyEqualsPlanningAWholeStretchAtOnce) {
  constexpr double kFactor = 1048576.0;
  Style style;
  style.extruder_alone = false;  // the bound of their acceleration does not scale
  for (unsigned seed = 100; seed < 130; ++seed) {
    const auto program = ProgramMaker(seed, style).make(4000);
    const auto lazy = run(program, Taking::always);
    const auto whole = run(program, Taking::at_the_end, kFactor);
    ASSERT_EQ(lazy.size(), whole.size());
    for (std::size_t i = 0; i < lazy.size(); ++i) {
      PlannedMove slower = whole[i];
      for (double* v : {&slower.start_v_mm_s, &slower.cruise_v_mm_s, &slower.end_v_mm_s}) {
        *v /= kFactor;
      }
      for (double* t : {&slower.accel_s, &slower.cruise_s, &slower.decel_s}) *t *= kFactor;
      slower.accel_mm_s2 /= kFactor * kFactor;
      ASSERT_NO_FATAL_FAILURE(expect_same(lazy[i], slower, i)) << "seed " << seed;
    }
  }
}

TEST(PlannerProperty, SpeedIsContinuousAndZeroAtBothEnds) {
  for (unsigned seed = 200; seed < 220; ++seed) {
    const auto moves = run(ProgramMaker(seed, {}).make(3000), Taking::always);
    EXPECT_EQ(moves.front().start_v_mm_s, 0.0);
    EXPECT_EQ(moves.back().end_v_mm_s, 0.0);
    for (std::size_t i = 1; i < moves.size(); ++i) {
      ASSERT_NEAR(moves[i - 1].end_v_mm_s, moves[i].start_v_mm_s, 1e-12)
          << "seed " << seed << " move " << i;
      if (!moves[i].kinematic || !moves[i - 1].kinematic) {
        ASSERT_EQ(moves[i].start_v_mm_s, 0.0);
      }
    }
  }
}

TEST(PlannerProperty, EveryMoveKeepsItsFeedItsAccelerationAndItsLength) {
  for (unsigned seed = 300; seed < 320; ++seed) {
    const auto moves = run(ProgramMaker(seed, {}).make(3000), Taking::always);
    for (const PlannedMove& move : moves) {
      const double v_s = move.start_v_mm_s;
      const double v_c = move.cruise_v_mm_s;
      const double v_e = move.end_v_mm_s;
      ASSERT_LE(v_c, move.segment.feed_mm_s * (1.0 + 1e-12));
      ASSERT_LE(std::max(v_s, v_e), v_c);
      ASSERT_GE(std::min({move.accel_s, move.cruise_s, move.decel_s, v_s, v_e}), 0.0);
      ASSERT_NEAR(v_c - v_s, move.accel_mm_s2 * move.accel_s, 1e-9 * v_c);
      ASSERT_NEAR(v_c - v_e, move.accel_mm_s2 * move.decel_s, 1e-9 * v_c);
      const double covered =
          0.5 * (v_s + v_c) * move.accel_s + v_c * move.cruise_s + 0.5 * (v_e + v_c) * move.decel_s;
      ASSERT_NEAR(covered, move.length_mm, 1e-9 * move.length_mm);
    }
  }
}

// At a corner the velocity vector may turn by no more than the square corner velocity allows, and
// the extruder's speed may jump by no more than instantaneous_corner_velocity.
TEST(PlannerProperty, JunctionsKeepTheLimitOfTheExtruderAndOfSharpCorners) {
  Style style;
  style.changes_cruise_ratio = false;
  for (unsigned seed = 400; seed < 410; ++seed) {
    const auto moves = run(ProgramMaker(seed, style).make(3000), Taking::always);
    for (std::size_t i = 1; i < moves.size(); ++i) {
      const double v = moves[i].start_v_mm_s;
      const auto& u = moves[i - 1].direction;
      const auto& w = moves[i].direction;
      ASSERT_LE(v * std::abs(w[gcode::E] - u[gcode::E]), 1.0 + 1e-9);
      if (u[0] * w[0] + u[1] * w[1] + u[2] * w[2] < 0.0) {
        ASSERT_LE(v, 20.0);
      }
    }
  }
}

TEST(PlannerProperty, NoRampCouldBeFasterAtAJunctionThanBothNeighboursReach) {
  for (unsigned seed = 500; seed < 510; ++seed) {
    const auto moves = run(ProgramMaker(seed, {}).make(3000), Taking::always);
    for (const PlannedMove& move : moves) {
      const double change =
          std::abs(move.start_v_mm_s * move.start_v_mm_s - move.end_v_mm_s * move.end_v_mm_s);
      ASSERT_LE(change, 2.0 * move.accel_mm_s2 * move.length_mm * (1.0 + 1e-9));
    }
  }
}

}  // namespace
}  // namespace unflex::planner
