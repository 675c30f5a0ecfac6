#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "tours.hpp"
#include "unflex/timing/timing.hpp"

namespace unflex::timing {
namespace {

using compensate::testing::at_rest;
using compensate::testing::plan;
using compensate::testing::planner_limits;
using testing::bounds_of;
using testing::Drawn;
using testing::kLiftBounds;
using testing::kTolerance_mm;
using testing::lift;
using testing::Moves;
using testing::played;
using testing::setup;
using testing::tour;

using Result = tl::expected<Timed, std::string>;

void expect_base_at_rest(const Timed& timed, const Moves& path, const compensate::Setup& of) {
  ASSERT_TRUE(timed.base.has_value());
  const dynamics::BaseTrajectory& base = *timed.base;
  const compensate::NodeGrid grid = compensate::node_grid(timed.moves, of);
  EXPECT_EQ(base.period_s, grid.period_s);
  ASSERT_EQ(base.nodes(), grid.count);
  ASSERT_EQ(base.y.position_mm.size(), grid.count);
  const gcode::Position& start = path.front().segment.start_mm;
  const gcode::Position& end = path.back().segment.end_mm;
  EXPECT_NEAR(base.x.position_mm.front(), start[gcode::X], 1e-6);
  EXPECT_NEAR(base.y.position_mm.front(), start[gcode::Y], 1e-6);
  EXPECT_NEAR(base.x.position_mm.back(), end[gcode::X], 1e-6);
  EXPECT_NEAR(base.y.position_mm.back(), end[gcode::Y], 1e-6);
  for (const dynamics::AxisTrajectory* const axis : {&base.x, &base.y}) {
    EXPECT_EQ(axis->velocity_mm_s.front(), 0.0);
    EXPECT_EQ(axis->velocity_mm_s.back(), 0.0);
    // It goes on from node to node.
    for (std::size_t k = 1; k < grid.count; ++k) {
      const double mean_mm_s =
          0.5 * (axis->velocity_mm_s[k - 1] + axis->velocity_mm_s[k]) -
          base.period_s / 12.0 * (axis->accel_mm_s2[k] - axis->accel_mm_s2[k - 1]);
      EXPECT_NEAR(axis->position_mm[k] - axis->position_mm[k - 1], base.period_s * mean_mm_s, 1e-9);
      EXPECT_NEAR(axis->velocity_mm_s[k] - axis->velocity_mm_s[k - 1],
                  0.5 * base.period_s * (axis->accel_mm_s2[k - 1] + axis->accel_mm_s2[k]), 1e-6);
    }
  }
}

TEST(Optimal, KeepsToleranceAndFeedAndIsNoSlowerThanFaster) {
  const auto engine = compensate::make_banded_engine();
  for (unsigned seed = 1; seed <= 6; ++seed) {
    const Moves moves = tour(seed, 40.0 * seed);
    const Result result = optimal(moves, setup(), at_rest(moves), bounds_of(moves));
    ASSERT_TRUE(result.has_value()) << seed << ' ' << result.error();
    expect_base_at_rest(*result, moves, setup());
    const std::optional<Timed> other =
        faster(moves, setup(), at_rest(moves), bounds_of(moves), *engine);
    ASSERT_TRUE(other.has_value()) << seed;
    EXPECT_LT(planner::duration_s(result->moves), 1.01 * planner::duration_s(other->moves)) << seed;
    const Drawn drawn = played(result->moves, *result->base, setup().x.axis);
    EXPECT_LT(drawn.largest_error_mm, 1.06 * kTolerance_mm) << seed;
    EXPECT_LT(drawn.fastest, 1.03) << seed;
    EXPECT_LT(drawn.swing_mm, 0.6 * kTolerance_mm) << seed;
  }
}

TEST(Optimal, GoesTheWholePathWithItsFilament) {
  const Moves moves = tour(8, 100.0, true);
  const Result result = optimal(moves, setup(), at_rest(moves), bounds_of(moves));
  ASSERT_TRUE(result.has_value()) << result.error();
  ASSERT_EQ(result->pieces.size(), moves.size());
  std::size_t next = 0;
  for (std::size_t i = 0; i < moves.size(); ++i) {
    ASSERT_GT(result->pieces[i], 0U);
    EXPECT_EQ(result->moves[next].segment.start_mm, moves[i].segment.start_mm);
    next += result->pieces[i];
    EXPECT_EQ(result->moves[next - 1].segment.end_mm, moves[i].segment.end_mm);
  }
  EXPECT_EQ(next, result->moves.size());
  const Drawn drawn = played(result->moves, *result->base, setup().x.axis);
  EXPECT_LT(drawn.error_while_laying_mm, 1.06 * kTolerance_mm);
  EXPECT_LT(drawn.largest_travel_mm, 1.06 * kTravelTolerance_mm);
}

TEST(Optimal, KeepsTheToleranceInABandOfFrequencies) {
  compensate::Setup band = setup();
  for (compensate::AxisSetup* const axis : {&band.x, &band.y}) {
    axis->plants = {{band.x.axis.detuned(0.95), 1.0 / 3.0, true},
                    {band.x.axis.detuned(1.05), 1.0 / 3.0, true}};
  }
  const Moves moves = plan({{0.0, 0.0}, {10.0, 0.0}, {10.0, 10.0}, {0.0, 12.0}},
                           planner_limits(100.0, 2000.0, 5.0));
  const Result robust = optimal(moves, band, at_rest(moves), bounds_of(moves));
  const Result exact = optimal(moves, setup(), at_rest(moves), bounds_of(moves));
  ASSERT_TRUE(robust.has_value()) << robust.error();
  ASSERT_TRUE(exact.has_value()) << exact.error();
  EXPECT_GT(planner::duration_s(robust->moves), planner::duration_s(exact->moves));
  EXPECT_LT(played(robust->moves, *robust->base, band.x.axis).largest_error_mm,
            1.06 * kTolerance_mm);
  for (const double factor : {0.95, 1.05}) {
    EXPECT_LT(played(robust->moves, *robust->base, band.x.axis.detuned(factor)).largest_error_mm,
              2.12 * kTolerance_mm)
        << factor;
  }
}

TEST(Optimal, RestsWhileMovesAreUpright) {
  Moves moves = plan({{0.0, 0.0}, {10.0, 0.0}, {10.0, 10.0}}, planner_limits(100.0, 2000.0, 5.0));
  std::vector<MoveBounds> bounds = bounds_of(moves);
  const Result level = optimal(moves, setup(), at_rest(moves), bounds);
  ASSERT_TRUE(level.has_value()) << level.error();
  // In the beginning.
  moves.insert(moves.begin(), lift(moves.front().segment.start_mm, 0.4));
  bounds.insert(bounds.begin(), kLiftBounds);
  const Result lifted = optimal(moves, setup(), at_rest(moves), bounds);
  ASSERT_TRUE(lifted.has_value()) << lifted.error();
  // 2 √(L/a)
  EXPECT_NEAR(planner::duration_s(lifted->moves),
              planner::duration_s(level->moves) + 2.0 * std::sqrt(0.4 / 100.0), 1e-6);
  expect_base_at_rest(*lifted, moves, setup());
  EXPECT_EQ(lifted->base->at(0.12).x.position_mm, 0.0);
  EXPECT_LT(played(lifted->moves, *lifted->base, setup().x.axis).largest_error_mm,
            1.06 * kTolerance_mm);
}

TEST(Optimal, TellsThatAxesHaveTwoModes) {
  compensate::Setup two = setup();
  two.y.axis = two.y.axis.followed_by(900.0, 0.1);
  ASSERT_EQ(two.y.axis.mode_count(), 2U);
  const Moves moves = tour(1, 100.0);
  const dynamics::NozzleXY rest{two.x.axis.riding(5.0), two.y.axis.riding(5.0)};
  const Result result = optimal(moves, two, rest, bounds_of(moves));
  ASSERT_FALSE(result.has_value());
  EXPECT_NE(result.error().find("modes"), std::string::npos);
}

TEST(Optimal, TellsThatItIsAPartOfARun) {
  const Moves all = tour(1, 100.0);
  const Moves before(all.begin(), all.begin() + 4);
  const Moves part(all.begin() + 4, all.end());
  const Result result = optimal({before, part, {}}, setup(), at_rest(all), bounds_of(part));
  ASSERT_FALSE(result.has_value());
  EXPECT_NE(result.error().find("part"), std::string::npos);
}

TEST(Optimal, TellsThatAccelerationAlongThePathIsBound) {
  const Moves moves = tour(1, 100.0);
  std::vector<MoveBounds> bounds = bounds_of(moves);
  bounds[3].accel_mm_s2 = 1000.0;
  const Result result = optimal(moves, setup(), at_rest(moves), bounds);
  ASSERT_FALSE(result.has_value());
  EXPECT_NE(result.error().find("acceleration"), std::string::npos);
}

TEST(Optimal, TellsThatNothingMovesInXOrY) {
  const Moves moves = {lift({3.0, 4.0, 0.0, 0.0}, 0.4)};
  const Result result = optimal(moves, setup(), at_rest(moves), std::vector{kLiftBounds});
  ASSERT_FALSE(result.has_value());
  EXPECT_NE(result.error().find("nothing moves"), std::string::npos);
}

}  // namespace
}  // namespace unflex::timing
