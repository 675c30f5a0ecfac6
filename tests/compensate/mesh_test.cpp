// Which nodes are solved, and where the base just moves along with the plan.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "playback.hpp"
#include "unflex/compensate/run.hpp"

namespace unflex::compensate {
namespace {

using Moves = std::vector<planner::PlannedMove>;

constexpr std::size_t kHalfBlend = 10;  // nodes on either side of a seam

// Straight lines of 1 to 150 mm; a third of them travel.
Moves random_run(std::mt19937_64& random) {
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::vector<testing::Point> points = {{0.0, 0.0}};
  for (int i = 0; i < 12; ++i) {
    const double length_mm = std::pow(10.0, 2.2 * uniform(random));
    const double angle = 6.3 * uniform(random);
    points.push_back({points.back().x_mm + length_mm * std::cos(angle),
                      points.back().y_mm + length_mm * std::sin(angle), uniform(random) < 0.67});
  }
  return testing::plan(points, testing::planner_limits(60.0, 4000.0, 5.0));
}

std::size_t solved_nodes(const std::vector<WindowSpan>& spans) {
  std::size_t nodes = 0;
  for (const WindowSpan& span : spans) {
    nodes += span.cruise ? 0 : span.last - span.first + 1;
  }
  return nodes;
}

TEST(Mesh, OfAStraightLineIsItsTwoRamps) {
  const Moves moves =
      testing::plan({{0.0, 0.0}, {600.0, 0.0}}, testing::planner_limits(60.0, 4000.0, 5.0));
  const compensate::Setup setup = testing::setup_for({}, 2e4);
  const NodeGrid grid = node_grid(moves, setup);
  ASSERT_GT(grid.count, 10'000U);
  const auto spans = mesh(moves, grid, setup);
  ASSERT_EQ(spans.size(), 3U);
  EXPECT_TRUE(spans[1].cruise);
  EXPECT_EQ(windows_to_solve(spans), 2U);
  EXPECT_LT(solved_nodes(spans), 200U);
}

TEST(Mesh, LeavesNothingOutWhereTheBaseHasNoSpeedToSpare) {
  const Moves moves =
      testing::plan({{0.0, 0.0}, {600.0, 0.0}}, testing::planner_limits(60.0, 4000.0, 5.0));
  compensate::Setup setup = testing::setup_for({}, 2e4);
  setup.x.limits.max_velocity_mm_s = 60.0;
  const auto spans = mesh(moves, node_grid(moves, setup), setup);
  EXPECT_EQ(windows_to_solve(spans), spans.size());
  EXPECT_GT(spans.size(), 4U);
}

TEST(Mesh, LaysWindowsAndCruisesEndToEnd) {
  std::mt19937_64 random(3);
  std::size_t cruises = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const Moves moves = random_run(random);
    compensate::Setup setup = testing::setup_for({}, 2e4);
    setup.period_s = trial % 3 == 0 ? 0.4e-3 : 1e-3;
    setup.window_s = trial % 2 == 0 ? 2.0 : 0.3;
    setup.overlap_s = trial % 5 == 0 ? 0.0 : 0.06;
    setup.lead_in_s = trial % 4 == 0 ? 0.02 : 0.0;
    const NodeGrid grid = node_grid(moves, setup);
    const auto spans = mesh(moves, grid, setup);
    EXPECT_FALSE(spans.front().cruise);
    EXPECT_FALSE(spans.back().cruise);
    EXPECT_EQ(spans.front().first, 0U);
    EXPECT_EQ(spans.front().core_first, 0U);
    EXPECT_EQ(spans.back().last, grid.count - 1);
    EXPECT_EQ(spans.back().core_last, grid.count - 1);
    for (std::size_t i = 0; i < spans.size(); ++i) {
      const WindowSpan& span = spans[i];
      cruises += span.cruise ? 1 : 0;
      EXPECT_LE(span.first, span.core_first);
      EXPECT_LT(span.core_first, span.core_last);
      EXPECT_LE(span.core_last, span.last);
      if (i > 0) {
        EXPECT_EQ(span.core_first, spans[i - 1].core_last);
        EXPECT_LE(span.first + kHalfBlend, span.core_first);
        EXPECT_GE(spans[i - 1].last, std::min(span.core_first + kHalfBlend, grid.count - 1));
        EXPECT_LE(spans[i - 1].last, span.last);
      }
    }
  }
  EXPECT_GT(cruises, 300U);
}

double largest_difference_mm(const Moves& moves, const Setup& setup) {
  const auto engine = make_banded_engine();
  const NodeGrid grid = node_grid(moves, setup);
  const auto spans = mesh(moves, grid, setup);
  auto problems = windows(moves, spans, testing::at_rest(moves), setup);
  std::vector<dynamics::AxisTrajectory> solutions;
  for (std::size_t i = 0; i < spans.size(); ++i) {
    const auto solution = solve(*engine, spans[i], problems[i])[0];
    EXPECT_TRUE(solution.has_value());
    solutions.push_back(solution.value_or(AxisSolution{}).base);
  }
  const dynamics::AxisTrajectory joined = join(spans, solutions);
  const auto whole = engine->solve(testing::x_window(moves, setup));
  EXPECT_TRUE(whole.has_value());
  double largest = 0.0;
  EXPECT_EQ(joined.position_mm.size(), grid.count);
  for (std::size_t k = 0; k < grid.count; ++k) {
    largest = std::max(largest, std::abs(joined.position_mm[k] - whole->base.position_mm[k]));
  }
  return largest;
}

TEST(Mesh, GivesTheMotionOfTheRunSolvedAsOne) {
  std::mt19937_64 random(4);
  for (int trial = 0; trial < 20; ++trial) {
    const Moves moves = random_run(random);
    compensate::Setup setup = testing::setup_for({}, trial % 2 == 0 ? 2e4 : 4500.0);
    if (trial % 3 == 0) {
      setup.x.limits.max_jerk_mm_s3 = setup.y.limits.max_jerk_mm_s3 = 2e6;
    }
    setup.window_s = 1000.0;
    EXPECT_LT(largest_difference_mm(moves, setup), 1e-5) << "run " << trial;
  }
}

}  // namespace
}  // namespace unflex::compensate
