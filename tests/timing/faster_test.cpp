#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <optional>
#include <vector>

#include "tours.hpp"
#include "unflex/timing/timing.hpp"

namespace unflex::timing {
namespace {

using compensate::testing::at_rest;
using compensate::testing::plan;
using compensate::testing::planner_limits;
using compensate::testing::Point;
using testing::bounds_of;
using testing::draw;
using testing::Drawn;
using testing::kMotors_mm_s2;
using testing::kTolerance_mm;
using testing::Moves;
using testing::setup;
using testing::tour;

std::optional<Timed> timed(const Moves& moves, const compensate::Setup& of,
                           const std::vector<MoveBounds>& bounds) {
  const auto engine = compensate::make_banded_engine();
  return faster(moves, of, at_rest(moves), bounds, *engine);
}

// The setup that the base of a timing is to be found for.
compensate::Setup with_plants_of(const Timed& result, compensate::Setup of) {
  if (result.plants) {
    of.x.plants = result.plants->x;
    of.y.plants = result.plants->y;
  }
  return of;
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
  const compensate::Setup found = with_plants_of(*robust, band);
  double worst_exact_mm = 0.0;
  for (const double factor : {0.95, 1.0, 1.05}) {
    const dynamics::FlexibleAxis axis = band.x.axis.detuned(factor);
    EXPECT_LT(draw(robust->moves, found, axis).largest_error_mm, 1.1 * kTolerance_mm) << factor;
    worst_exact_mm = std::max(worst_exact_mm, draw(exact->moves, setup(), axis).largest_error_mm);
  }
  EXPECT_GT(worst_exact_mm, 2.0 * kTolerance_mm);
}

// Squared errors are least where the rare plant strays far, but the largest error counts.
TEST(Faster, GivesMoreShareToThePlantThatStraysFurthest) {
  constexpr double kRare = 0.06;
  compensate::Setup likely = setup();
  for (compensate::AxisSetup* const axis : {&likely.x, &likely.y}) {
    axis->plants = {{likely.x.axis.detuned(0.94), kRare}, {likely.x.axis.detuned(1.01), kRare}};
  }
  const Moves moves = tour(10, 150.0);
  const auto result = timed(moves, likely, bounds_of(moves));
  ASSERT_TRUE(result.has_value() && result->plants.has_value());
  for (const std::vector<compensate::Plant>* const plants :
       {&result->plants->x, &result->plants->y}) {
    ASSERT_FALSE(plants->empty());
    EXPECT_EQ(plants->front().axis.main_rad_s(), likely.x.plants.front().axis.main_rad_s());
    EXPECT_GT(plants->front().share, 2.0 * kRare);
    double sum = 0.0;
    for (const compensate::Plant& plant : *plants) {
      sum += plant.share;
    }
    EXPECT_LT(sum, 1.0);
  }
  const Drawn drawn =
      draw(result->moves, with_plants_of(*result, likely), likely.x.plants.front().axis);
  EXPECT_LT(drawn.largest_error_mm, 1.1 * kTolerance_mm);
}

// A bowden's extruder cannot follow what a tolerance of the nozzle alone would allow.
TEST(Faster, GivesWayToTheExtruder) {
  Moves moves = tour(3, 120.0);
  for (planner::PlannedMove& move : moves) {
    move.direction[gcode::E] = 0.035;
  }
  const auto engine = compensate::make_banded_engine();
  const auto free = faster(moves, setup(), at_rest(moves), bounds_of(moves), *engine);
  ASSERT_TRUE(free.has_value());
  double last_s = planner::duration_s(free->moves);
  for (const double accel_mm_s2 : {20000.0, 10000.0, 5000.0}) {
    const auto even = faster(
        moves, setup(), at_rest(moves), bounds_of(moves), *engine,
        Extruder{
            .hotend = {.advance_s = 0.4}, .max_accel_mm_s2 = accel_mm_s2, .width_tolerance = 0.1});
    ASSERT_TRUE(even.has_value()) << accel_mm_s2;
    EXPECT_GT(planner::duration_s(even->moves), last_s) << accel_mm_s2;
    last_s = planner::duration_s(even->moves);
  }
  // One that follows everything changes nothing.
  const auto quick = faster(
      moves, setup(), at_rest(moves), bounds_of(moves), *engine,
      Extruder{.hotend = {.advance_s = 0.01}, .max_accel_mm_s2 = 1e6, .width_tolerance = 0.1});
  ASSERT_TRUE(quick.has_value());
  EXPECT_EQ(planner::duration_s(quick->moves), planner::duration_s(free->moves));
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

// A base that suits a band of frequencies goes ahead of the path and back.
compensate::Setup for_a_band() {
  compensate::Setup band = setup();
  for (compensate::AxisSetup* const axis : {&band.x, &band.y}) {
    axis->plants = {{band.x.axis.detuned(0.9), 1.0 / 3.0}, {band.x.axis.detuned(1.1), 1.0 / 3.0}};
  }
  return band;
}

std::optional<Timed> with_feed_kept(const Moves& moves, const std::vector<MoveBounds>& bounds) {
  const auto engine = compensate::make_banded_engine();
  return within_feed(moves, for_a_band(), at_rest(moves), bounds, *engine);
}

TEST(WithinFeed, SlowsDownTheNozzleWhereItRunsAheadOfFAndNowhereElse) {
  int slowed = 0;
  for (unsigned seed = 21; seed <= 28; ++seed) {
    const Moves moves = tour(seed, 25.0 * (seed % 4 + 1));
    const auto result = with_feed_kept(moves, bounds_of(moves));
    const Drawn sliced = draw(moves, for_a_band(), setup().x.axis);
    if (!result) {
      EXPECT_LT(sliced.fastest, 1.02) << seed;
      continue;
    }
    EXPECT_GT(sliced.fastest, 1.0) << seed;
    ++slowed;
    const Drawn drawn = draw(result->moves, for_a_band(), setup().x.axis);
    EXPECT_LT(drawn.fastest, 1.025) << seed << ", before " << sliced.fastest;
    EXPECT_LT(drawn.duration_s, 1.05 * planner::duration_s(moves)) << seed;
  }
  EXPECT_GT(slowed, 3);
}

TEST(WithinFeed, SlowsDownTheBaseInTravel) {
  constexpr double kFeed_mm_s = 160.0;
  const Moves moves =
      plan({{0.0, 0.0}, {8.0, 0.0, false}}, planner_limits(kFeed_mm_s, 5000.0, 5.0));
  std::vector<MoveBounds> bounds = bounds_of(moves);
  EXPECT_FALSE(with_feed_kept(moves, bounds));  // Nothing says how fast travel may be.
  bounds.front().nozzle_speed_mm_s = 0.985 * kFeed_mm_s;
  const auto result = with_feed_kept(moves, bounds);
  ASSERT_TRUE(result.has_value());
  EXPECT_GT(draw(moves, for_a_band(), setup().x.axis).base_mm_s, 1.01 * kFeed_mm_s);
  EXPECT_LT(draw(result->moves, for_a_band(), setup().x.axis).base_mm_s, 1.005 * kFeed_mm_s);
}

}  // namespace
}  // namespace unflex::timing
