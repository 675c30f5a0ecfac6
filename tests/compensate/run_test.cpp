#include "unflex/compensate/run.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <span>
#include <vector>

#include "playback.hpp"

namespace unflex::compensate {
namespace {

using testing::plan_at;
using testing::planner_limits;
using testing::setup_for;

constexpr std::size_t kHalfBlend = 10;  // nodes on either side of a seam

std::vector<planner::PlannedMove> short_run() {
  return testing::plan({{10.0, 20.0}, {14.0, 20.0, false}, {14.0, 23.0}, {11.0, 26.0}},
                       planner_limits(100.0, 5000.0, 5.0));
}

// Random corners, about a fifth of a second apart.
std::vector<planner::PlannedMove> long_run(int corners) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform(0.0, 40.0);
  std::vector<testing::Point> points;
  for (int i = 0; i < corners; ++i) {
    points.push_back({uniform(random), uniform(random), i % 5 != 0});
  }
  return testing::plan(points, planner_limits(120.0, 5000.0, 5.0));
}

// ---- length and cuts ---------------------------------------------------------------------------

TEST(NodeCount, CoversLeadInMovesAndTail) {
  const auto moves = short_run();
  compensate::Setup setup = setup_for({}, 2e4);
  setup.lead_in_s = 7e-3;
  setup.tail_s = 5e-3;
  for (const double period : {1e-3, 0.7e-3, 2e-3}) {
    setup.period_s = period;
    const double last = static_cast<double>(node_grid(moves, setup).count - 1) * period;
    const double needed = 12e-3 + duration_s(moves);
    EXPECT_GE(last, needed - 1e-9);
    EXPECT_LT(last, needed + period);
  }
}

TEST(NodeCount, IsNeverTooSmallToBeSolved) {
  const auto moves = testing::plan({{0.0, 0.0}, {1e-4, 0.0}}, planner_limits(100.0, 5000.0, 5.0));
  compensate::Setup setup = setup_for({}, 2e4);
  setup.tail_s = 0.0;
  const std::size_t nodes = node_grid(moves, setup).count;
  EXPECT_EQ(nodes, 4U);
  const auto run = windows(moves, cut(nodes, setup), testing::at_rest(moves), setup);
  EXPECT_TRUE(make_ipopt_engine()->solve(run.front().x).has_value());
}

TEST(Cut, LeavesAShortRunWhole) {
  const compensate::Setup setup;  // cores of 2000 nodes, 60 of overlap
  for (const std::size_t nodes : {4U, 2000U, 2120U}) {
    const auto spans = cut(nodes, setup);
    ASSERT_EQ(spans.size(), 1U);
    EXPECT_EQ(spans[0].first, 0U);
    EXPECT_EQ(spans[0].core_first, 0U);
    EXPECT_EQ(spans[0].core_last, nodes - 1);
    EXPECT_EQ(spans[0].last, nodes - 1);
  }
  EXPECT_EQ(cut(2121, setup).size(), 2U);
}

TEST(Cut, LaysCoresEndToEndWithRoomForTheBlends) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  int several = 0;
  for (int trial = 0; trial < 3000; ++trial) {
    compensate::Setup setup;
    setup.period_s = std::pow(10.0, -4.0 + 2.3 * uniform(random));
    setup.window_s = 0.05 * std::pow(10.0, 2.0 * uniform(random));
    setup.overlap_s = uniform(random) < 0.2 ? 0.0 : 0.2 * uniform(random);
    const auto nodes = static_cast<std::size_t>(std::pow(10.0, 0.7 + 3.5 * uniform(random)));
    const auto spans = cut(nodes, setup);
    several += spans.size() > 1 ? 1 : 0;
    ASSERT_FALSE(spans.empty());
    EXPECT_EQ(spans.front().core_first, 0U);
    EXPECT_EQ(spans.back().core_last, nodes - 1);
    EXPECT_EQ(spans.back().last, nodes - 1);
    const double wanted = setup.window_s / setup.period_s;
    for (std::size_t i = 0; i < spans.size(); ++i) {
      const WindowSpan& span = spans[i];
      EXPECT_LE(span.first, span.core_first);
      EXPECT_LT(span.core_first, span.core_last);
      EXPECT_LE(span.core_last, span.last);
      EXPECT_LT(span.last, nodes);
      if (i > 0) {
        // Each node is in one core: a core begins where the one before ends. Both windows cover the
        // whole blend between them, and the blend lies within the cores.
        EXPECT_EQ(span.core_first, spans[i - 1].core_last);
        ASSERT_GE(span.core_first, kHalfBlend);
        EXPECT_LE(span.first, span.core_first - kHalfBlend);
        EXPECT_GE(spans[i - 1].last, std::min(span.core_first + kHalfBlend, nodes - 1));
        EXPECT_LE(static_cast<double>(span.core_last - span.core_first),
                  std::max(wanted, 2.0 * kHalfBlend) + 2.0);
      }
    }
  }
  EXPECT_GT(several, 500);
}

// ---- windows -----------------------------------------------------------------------------------

TEST(Windows, TakeReferenceAndWeightFromThePlan) {
  const auto moves = short_run();
  compensate::Setup setup = setup_for({}, 2e4);
  setup.lead_in_s = 3.3e-3;
  setup.travel_weight = 0.25;
  const std::size_t nodes = node_grid(moves, setup).count;
  const auto run = windows(moves, cut(nodes, setup), testing::at_rest(moves), setup);
  ASSERT_EQ(run.size(), 1U);
  ASSERT_EQ(run[0].x.reference_mm.size(), 2 * nodes - 1);
  ASSERT_EQ(run[0].y.reference_mm.size(), 2 * nodes - 1);
  EXPECT_EQ(run[0].x.nodes(), nodes);
  EXPECT_EQ(run[0].x.weight, run[0].y.weight);
  const double travel_end = setup.lead_in_s + moves[0].duration_s();
  const double end = setup.lead_in_s + duration_s(moves);
  for (std::size_t i = 0; i < 2 * nodes - 1; ++i) {
    const double t = 0.5 * static_cast<double>(i) * setup.period_s;
    const gcode::Position expected = plan_at(moves, std::max(t - setup.lead_in_s, 0.0));
    EXPECT_NEAR(run[0].x.reference_mm[i], expected[gcode::X], 1e-10) << t;
    EXPECT_NEAR(run[0].y.reference_mm[i], expected[gcode::Y], 1e-10) << t;
    EXPECT_EQ(run[0].x.weight[i], t > travel_end && t < end ? 1.0 : 0.25) << t;
  }
}

// Solves all windows of a course and returns x of the base between the course's ends.
std::vector<double> base_x_mm(const Course& course, const compensate::Setup& setup) {
  const NodeGrid grid = node_grid(course, setup);
  const auto spans = cut(grid.count, setup);
  const auto engine = make_banded_engine();
  std::vector<dynamics::AxisTrajectory> solutions;
  const auto nozzle = dynamics::NozzleXY{{course.moves.front().segment.start_mm[0], 0.0},
                                         {course.moves.front().segment.start_mm[1], 0.0}};
  for (const RunWindow& window : windows(course, spans, nozzle, setup)) {
    solutions.push_back(engine->solve(window.x)->base);
  }
  const std::vector<double> all = join(spans, solutions).position_mm;
  return {all.begin() + static_cast<std::ptrdiff_t>(grid.first),
          all.begin() + static_cast<std::ptrdiff_t>(grid.last) + 1};
}

TEST(Windows, OfPartsOfARunGiveTheSameBaseAsThoseOfTheWhole) {
  const auto moves = long_run(60);
  // The places of the nodes matter a little, mostly at corners.
  const compensate::Setup setup = setup_for({}, 2e4);
  const std::vector<double> whole = base_x_mm(moves, setup);
  const std::span<const planner::PlannedMove> all(moves);
  for (const std::size_t border : {20U, 31U, 40U}) {
    const Course first({}, all.first(border), all.subspan(border));
    const Course second(all.first(border), all.subspan(border), {});
    const NodeGrid grid = node_grid(first, setup);
    EXPECT_NEAR(static_cast<double>(grid.last) * grid.period_s,
                setup.lead_in_s + duration_s(all.first(border)), 1e-12);
    EXPECT_NEAR(grid.period_s, setup.period_s, 1e-3 * setup.period_s);
    const std::vector<double> before = base_x_mm(first, setup);
    const std::vector<double> after = base_x_mm(second, setup);
    ASSERT_EQ(before.size(), grid.last + 1);
    // The two parts meet, and they begin and end where the whole does.
    EXPECT_NEAR(before.back(), after.front(), 1e-3) << border;
    EXPECT_NEAR(before.front(), whole.front(), 1e-9);
    EXPECT_NEAR(after.back(), whole.back(), 1e-9);
  }
}

TEST(Windows, OfACutRunAreSlicesOfTheWhole) {
  const auto moves = long_run(30);
  compensate::Setup setup = setup_for({}, 2e4);
  const std::size_t nodes = node_grid(moves, setup).count;
  setup.window_s = 0.5;
  setup.overlap_s = 0.03;
  const auto spans = cut(nodes, setup);
  ASSERT_GT(spans.size(), 3U);
  const auto nozzle = dynamics::NozzleXY{{moves[0].segment.start_mm[0] + 0.01, 2.0},
                                         {moves[0].segment.start_mm[1], -1.0}};
  const auto whole = windows(moves, {{0, nodes - 1, 0, nodes - 1}}, nozzle, setup).front();
  const auto parts = windows(moves, spans, nozzle, setup);
  ASSERT_EQ(parts.size(), spans.size());
  for (std::size_t i = 0; i < parts.size(); ++i) {
    ASSERT_EQ(parts[i].y.reference_mm.size(), 2 * (spans[i].last - spans[i].first) + 1);
    const auto offset = static_cast<std::ptrdiff_t>(2 * spans[i].first);
    EXPECT_TRUE(std::ranges::equal(
        parts[i].y.reference_mm,
        std::ranges::subrange(whole.y.reference_mm.begin() + offset,
                              whole.y.reference_mm.begin() + offset +
                                  static_cast<std::ptrdiff_t>(parts[i].y.reference_mm.size()))));
    EXPECT_EQ(parts[i].x.start.has_value(), i == 0);
    EXPECT_EQ(parts[i].x.end_base_mm.has_value(), i + 1 == parts.size());
  }
  EXPECT_EQ(parts[0].x.start->nozzle.position(), nozzle.x.position());
  EXPECT_EQ(parts[0].x.start->nozzle.velocity(), 2.0);
  EXPECT_EQ(parts[0].y.start->nozzle.velocity(), -1.0);
  EXPECT_EQ(parts[0].x.start->base_mm, moves.front().segment.start_mm[gcode::X]);
  EXPECT_NEAR(*parts.back().y.end_base_mm, moves.back().segment.end_mm[gcode::Y], 1e-12);
}

TEST(Windows, WidenTheTravelToThePathAndNoFurther) {
  const auto moves = short_run();  // x from 10 to 14, y from 20 to 26
  compensate::Setup setup = setup_for({}, 2e4);
  setup.x.limits.min_position_mm = 0.0;
  setup.x.limits.max_position_mm = 12.0;
  setup.y.limits.min_position_mm = 21.0;
  setup.y.limits.max_position_mm = 40.0;
  const auto run =
      windows(moves, cut(node_grid(moves, setup).count, setup), testing::at_rest(moves), setup)
          .front();
  EXPECT_EQ(run.x.limits.min_position_mm, 0.0);
  EXPECT_NEAR(run.x.limits.max_position_mm, 14.0, 1e-12);
  EXPECT_NEAR(run.y.limits.min_position_mm, 20.0, 1e-12);
  EXPECT_EQ(run.y.limits.max_position_mm, 40.0);
  EXPECT_EQ(run.x.limits.max_accel_mm_s2, 2e4);
  EXPECT_DOUBLE_EQ(
      run.x.jerk_weight,
      setup.jerk_weight * std::pow(setup.x.axis.main().omega_rad_s * setup.period_s, 4));
}

// ---- joining -----------------------------------------------------------------------------------

struct Solved {
  std::vector<WindowSpan> spans;
  dynamics::AxisTrajectory joined;
  dynamics::AxisTrajectory whole;
  double period_s;
};

Solved solve_both(const std::vector<planner::PlannedMove>& moves, const Setup& setup) {
  const std::size_t nodes = node_grid(moves, setup).count;
  const auto engine = make_ipopt_engine();
  Solved result;
  result.period_s = setup.period_s;
  result.spans = cut(nodes, setup);
  std::vector<dynamics::AxisTrajectory> solutions;
  for (const RunWindow& window : windows(moves, result.spans, testing::at_rest(moves), setup)) {
    const auto solution = engine->solve(window.x);
    EXPECT_TRUE(solution.has_value());
    solutions.push_back(solution.value_or(AxisSolution{}).base);
  }
  result.joined = join(result.spans, solutions);
  const auto whole = engine->solve(testing::x_window(moves, setup));
  EXPECT_TRUE(whole.has_value());
  result.whole = whole.value_or(AxisSolution{}).base;
  return result;
}

TEST(Join, OfWindowsIsTheRunSolvedAsOne) {
  const auto moves = long_run(40);
  compensate::Setup setup = setup_for({}, 2e4);
  setup.window_s = 1.0;
  const Solved solved = solve_both(moves, setup);
  ASSERT_GT(solved.spans.size(), 5U);
  ASSERT_EQ(solved.joined.position_mm.size(), solved.whole.position_mm.size());
  double worst = 0.0;
  double kink = 0.0;
  double accel = 0.0;
  for (std::size_t k = 0; k < solved.whole.position_mm.size(); ++k) {
    worst = std::max(worst, std::abs(solved.joined.position_mm[k] - solved.whole.position_mm[k]));
    accel = std::max(accel, std::abs(solved.joined.accel_mm_s2[k]));
    if (k > 0) {
      const dynamics::AxisMotion end =
          dynamics::between(solved.joined, k - 1, solved.period_s, solved.period_s);
      kink = std::max(kink, std::abs(end.position_mm - solved.joined.position_mm[k]));
    }
  }
  EXPECT_LT(worst, 1e-7);
  EXPECT_LT(kink, 1e-7);
  EXPECT_LE(accel, 2e4 * (1.0 + 2e-6));
}

TEST(Join, TakesEachWindowAloneOutsideTheBlends) {
  compensate::Setup setup;
  setup.period_s = 1e-3;
  setup.window_s = 0.05;
  setup.overlap_s = 0.02;
  const auto spans = cut(200, setup);
  ASSERT_GT(spans.size(), 2U);
  // The solution of window i has the value i everywhere.
  std::vector<dynamics::AxisTrajectory> solutions;
  for (std::size_t i = 0; i < spans.size(); ++i) {
    const std::vector<double> values(spans[i].last - spans[i].first + 1, static_cast<double>(i));
    solutions.push_back({values, values, values});
  }
  const dynamics::AxisTrajectory joined = join(spans, solutions);
  ASSERT_EQ(joined.position_mm.size(), 200U);
  EXPECT_EQ(joined.position_mm, joined.velocity_mm_s);
  EXPECT_EQ(joined.position_mm, joined.accel_mm_s2);
  for (std::size_t i = 0; i < spans.size(); ++i) {
    for (std::size_t k = spans[i].core_first; k <= spans[i].core_last; ++k) {
      const bool near_start = i > 0 && k < spans[i].core_first + kHalfBlend;
      const bool near_end = i + 1 < spans.size() && k + kHalfBlend > spans[i].core_last;
      if (!near_start && !near_end) {
        EXPECT_EQ(joined.position_mm[k], static_cast<double>(i)) << k;
      }
    }
    if (i > 0) {
      EXPECT_DOUBLE_EQ(joined.position_mm[spans[i].core_first], static_cast<double>(i) - 0.5);
    }
  }
  EXPECT_TRUE(std::ranges::is_sorted(joined.position_mm));
}

TEST(Join, OfOneWindowIsThatWindow) {
  const dynamics::AxisTrajectory only{{1.0, 2.0}, {3.0, 4.0}, {5.0, 6.0}};
  const dynamics::AxisTrajectory joined = join({{0, 1, 0, 1}}, {only});
  EXPECT_EQ(joined.position_mm, only.position_mm);
  EXPECT_EQ(joined.velocity_mm_s, only.velocity_mm_s);
  EXPECT_EQ(joined.accel_mm_s2, only.accel_mm_s2);
}

}  // namespace
}  // namespace unflex::compensate
