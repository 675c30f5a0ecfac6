#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <random>
#include <vector>

#include "../compensate/playback.hpp"
#include "unflex/timing/timing.hpp"

namespace unflex::timing {
namespace {

using compensate::testing::at_rest;
using compensate::testing::kSubsteps;
using compensate::testing::plan;
using compensate::testing::planner_limits;
using compensate::testing::Point;
using Moves = std::vector<planner::PlannedMove>;

constexpr double kTolerance_mm = 20e-3;
constexpr double kMotors_mm_s2 = 20000.0;

compensate::Setup setup() {
  compensate::Setup result =
      compensate::testing::setup_for(dynamics::from_frequency(45.0, 0.06), kMotors_mm_s2);
  result.end_weight = 10.0;
  return result;
}

std::vector<MoveBounds> bounds_of(const Moves& moves) {
  std::vector<MoveBounds> bounds;
  for (const planner::PlannedMove& move : moves) {
    bounds.push_back({.speed_mm_s = move.segment.feed_mm_s, .tolerance_mm = kTolerance_mm});
  }
  return bounds;
}

// A tour of corners of all angles, some close together, at a constant F.
Moves tour(unsigned seed, double feed_mm_s, bool travels = false) {
  constexpr std::size_t kCorners = 12;
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> place(0.0, 15.0);
  std::uniform_real_distribution<double> near(-0.5, 0.5);
  std::vector<Point> points = {{5.0, 5.0}};
  for (std::size_t i = 0; i < kCorners; ++i) {
    points.push_back(
        i % 3 == 2 ? Point{points.back().x_mm + near(random), points.back().y_mm + near(random)}
                   : Point{place(random), place(random), !travels || i % 4 != 3});
  }
  return plan(points, planner_limits(feed_mm_s, 2000.0, 5.0));
}

// What a nozzle of these axes does on the base that is found for the moves.
struct Drawn {
  double duration_s = 0.0;
  double largest_error_mm = 0.0;   // while filament is laid
  double largest_travel_mm = 0.0;  // at any time
  double fastest = 0.0;            // relative to F, likewise
  double swing_mm = 0.0;           // in the end
  double accel_mm_s2 = 0.0;        // of the base
};

double distance_mm(const planner::PlannedMove& move, double x_mm, double y_mm) {
  const double px = x_mm - move.segment.start_mm[gcode::X];
  const double py = y_mm - move.segment.start_mm[gcode::Y];
  const double along = std::clamp(px * move.direction[gcode::X] + py * move.direction[gcode::Y],
                                  0.0, move.length_mm);
  return std::hypot(px - along * move.direction[gcode::X], py - along * move.direction[gcode::Y]);
}

Drawn draw(const Moves& moves, const compensate::Setup& of, const dynamics::FlexibleAxis& axis) {
  const std::vector<compensate::WindowSpan> spans = mesh(moves, node_grid(moves, of), of);
  std::vector<compensate::RunWindow> windows =
      compensate::windows(moves, spans, at_rest(moves), of);
  const auto engine = compensate::make_banded_engine();
  std::array<std::vector<dynamics::AxisTrajectory>, 2> solved;
  for (std::size_t i = 0; i < spans.size(); ++i) {
    compensate::AxisSolutions solutions = compensate::solve(*engine, spans[i], windows[i]);
    solved[0].push_back(solutions[0]->base);
    solved[1].push_back(solutions[1]->base);
  }
  const dynamics::AxisTrajectory x = compensate::join(spans, solved[0]);
  const dynamics::AxisTrajectory y = compensate::join(spans, solved[1]);
  Drawn drawn;
  drawn.duration_s = planner::duration_s(moves);
  for (const dynamics::AxisTrajectory* base : {&x, &y}) {
    for (const double accel : base->accel_mm_s2) {
      drawn.accel_mm_s2 = std::max(drawn.accel_mm_s2, std::abs(accel));
    }
  }
  const auto nozzle_x = compensate::testing::play(axis, x, of.period_s, at_rest(moves).x);
  const auto nozzle_y = compensate::testing::play(axis, y, of.period_s, at_rest(moves).y);
  constexpr double kReach_s = 31e-3;
  for (std::size_t i = 0; i < nozzle_x.size(); ++i) {
    const double t = static_cast<double>(i) * of.period_s / kSubsteps;
    double least_mm = std::numeric_limits<double>::infinity();
    const planner::PlannedMove* on = nullptr;
    double start_s = 0.0;
    for (const planner::PlannedMove& move : moves) {
      if (start_s - kReach_s <= t && t <= start_s + move.duration_s() + kReach_s) {
        const double away_mm = distance_mm(move, nozzle_x[i].position(), nozzle_y[i].position());
        if (away_mm < least_mm) {
          least_mm = away_mm;
          on = &move;
        }
      }
      start_s += move.duration_s();
    }
    drawn.largest_travel_mm = std::max(drawn.largest_travel_mm, least_mm);
    if (on != nullptr && on->segment.extruding()) {
      drawn.largest_error_mm = std::max(drawn.largest_error_mm, least_mm);
      drawn.fastest =
          std::max(drawn.fastest, std::hypot(nozzle_x[i].velocity(), nozzle_y[i].velocity()) /
                                      on->segment.feed_mm_s);
    }
  }
  const gcode::Position& end = moves.back().segment.end_mm;
  const auto gap_x = axis.gap(nozzle_x.back(), axis.riding(end[gcode::X]));
  const auto gap_y = axis.gap(nozzle_y.back(), axis.riding(end[gcode::Y]));
  drawn.swing_mm =
      std::hypot(gap_x.place_mm, gap_x.speed_mm, std::hypot(gap_y.place_mm, gap_y.speed_mm));
  return drawn;
}

std::optional<Timed> timed(const Moves& moves, const compensate::Setup& of,
                           const std::vector<MoveBounds>& bounds) {
  const auto engine = compensate::make_banded_engine();
  return faster(moves, of, at_rest(moves), bounds, *engine);
}

TEST(Faster, KeepsToleranceFeedAndMotorsInLessTime) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    const Moves moves = tour(seed, 40.0 * seed);
    const auto result = timed(moves, setup(), bounds_of(moves));
    ASSERT_TRUE(result.has_value()) << seed;
    const Drawn drawn = draw(result->moves, setup(), setup().x.axis);
    EXPECT_LT(drawn.duration_s, 0.9 * planner::duration_s(moves)) << seed;
    EXPECT_LT(drawn.largest_error_mm, 1.1 * kTolerance_mm) << seed;
    EXPECT_LT(drawn.fastest, 1.03) << seed;
    EXPECT_LT(drawn.swing_mm, 0.6 * kTolerance_mm) << seed;
    EXPECT_LT(drawn.accel_mm_s2, 1.001 * kMotors_mm_s2) << seed;
  }
}

TEST(Faster, LeavesTheWayOfTravelByLittle) {
  for (unsigned seed = 11; seed <= 16; ++seed) {
    const Moves moves = tour(seed, 150.0, true);
    const auto result = timed(moves, setup(), bounds_of(moves));
    ASSERT_TRUE(result.has_value()) << seed;
    const Drawn drawn = draw(result->moves, setup(), setup().x.axis);
    EXPECT_LT(drawn.duration_s, 0.9 * planner::duration_s(moves)) << seed;
    EXPECT_LT(drawn.largest_travel_mm, 1.1 * kTravelTolerance_mm) << seed;
  }
}

TEST(Faster, GoesTheWholePathWithItsFilament) {
  const Moves moves = tour(7, 100.0, true);
  const auto result = timed(moves, setup(), bounds_of(moves));
  ASSERT_TRUE(result.has_value());
  ASSERT_EQ(result->pieces.size(), moves.size());
  std::size_t next = 0;
  for (std::size_t i = 0; i < moves.size(); ++i) {
    ASSERT_GT(result->pieces[i], 0U);
    EXPECT_EQ(result->moves[next].segment.start_mm, moves[i].segment.start_mm);
    next += result->pieces[i];
    EXPECT_EQ(result->moves[next - 1].segment.end_mm, moves[i].segment.end_mm);
    EXPECT_EQ(result->moves[next - 1].segment.line, moves[i].segment.line);
  }
  EXPECT_EQ(next, result->moves.size());
}

TEST(Faster, ToleratesMoreInLessTime) {
  const Moves moves = tour(8, 200.0);
  double last_s = planner::duration_s(moves);
  for (const double tolerance_mm : {5e-3, 20e-3, 80e-3}) {
    std::vector<MoveBounds> bounds = bounds_of(moves);
    for (MoveBounds& own : bounds) {
      own.tolerance_mm = tolerance_mm;
    }
    const auto result = timed(moves, setup(), bounds);
    ASSERT_TRUE(result.has_value()) << tolerance_mm;
    EXPECT_LT(planner::duration_s(result->moves), last_s) << tolerance_mm;
    last_s = planner::duration_s(result->moves);
  }
}

TEST(Faster, KeepsTheToleranceForAllThatTheAxesMayBe) {
  compensate::Setup band = setup();
  for (compensate::AxisSetup* const axis : {&band.x, &band.y}) {
    axis->plants = {{band.x.axis.detuned(0.95), 1.0 / 3.0}, {band.x.axis.detuned(1.05), 1.0 / 3.0}};
  }
  const Moves moves = tour(9, 150.0);
  const auto robust = timed(moves, band, bounds_of(moves));
  const auto exact = timed(moves, setup(), bounds_of(moves));
  ASSERT_TRUE(robust.has_value() && exact.has_value());
  EXPECT_GT(planner::duration_s(robust->moves), planner::duration_s(exact->moves));
  double worst_exact_mm = 0.0;
  for (const double factor : {0.95, 1.0, 1.05}) {
    const dynamics::FlexibleAxis axis = band.x.axis.detuned(factor);
    EXPECT_LT(draw(robust->moves, band, axis).largest_error_mm, 1.1 * kTolerance_mm) << factor;
    worst_exact_mm = std::max(worst_exact_mm, draw(exact->moves, setup(), axis).largest_error_mm);
  }
  EXPECT_GT(worst_exact_mm, 2.0 * kTolerance_mm);
}

TEST(Faster, LeavesAPartAsItIsWhereItMeetsItsNeighbours) {
  // 0.3 s of it are some 15 mm at 50 mm/s.
  std::vector<Point> points;
  for (int i = 0; i <= 60; ++i) {
    points.push_back({static_cast<double>(i), i % 2 == 0 ? 0.0 : 1.5});
  }
  const Moves all = plan(points, planner_limits(50.0, 2000.0, 5.0));
  const Moves before(all.begin(), all.begin() + 20);
  const Moves part(all.begin() + 20, all.begin() + 45);
  const Moves after(all.begin() + 45, all.end());
  const auto engine = compensate::make_banded_engine();
  const auto result =
      faster({before, part, after}, setup(), at_rest(all), bounds_of(part), *engine);
  ASSERT_TRUE(result.has_value());
  EXPECT_LT(planner::duration_s(result->moves), planner::duration_s(part));
  EXPECT_NEAR(result->moves.front().start_v_mm_s, part.front().start_v_mm_s, 1e-9);
  EXPECT_NEAR(result->moves.back().end_v_mm_s, part.back().end_v_mm_s, 1e-9);
  const double first_s = std::accumulate(
      result->moves.begin(), result->moves.begin() + static_cast<std::ptrdiff_t>(result->pieces[0]),
      0.0, [](double sum, const planner::PlannedMove& move) { return sum + move.duration_s(); });
  EXPECT_NEAR(first_s, part.front().duration_s(), 1e-9);
}

TEST(Faster, GivesUpWhereNothingIsToBeGained) {
  // The plan is already as fast as the motors are.
  const Moves moves = plan({{0.0, 0.0}, {2.0, 0.0}}, planner_limits(500.0, kMotors_mm_s2, 5.0));
  EXPECT_FALSE(timed(moves, setup(), bounds_of(moves)).has_value());
}

}  // namespace
}  // namespace unflex::timing
