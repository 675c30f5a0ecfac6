#include "timed_moves.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "sections.hpp"
#include "tours.hpp"

namespace unflex::timing {
namespace {

using compensate::testing::plan;
using compensate::testing::planner_limits;
using testing::bounds_of;
using testing::kLiftBounds;
using testing::lift;
using testing::Moves;

constexpr double kNode_s = 2e-3;

// Three moves, and where it is asked for, others in Z before, within and behind them.
struct Path {
  Moves moves;
  std::vector<MoveBounds> bounds;
  double lift_s = 0.0;  // how long a move in Z takes
};

Path path(bool is_lifted) {
  Path result;
  result.moves =
      plan({{0.0, 0.0}, {3.0, 0.0}, {3.0, 4.0}, {3.0, 4.5}}, planner_limits(100.0, 2000.0, 5.0));
  if (is_lifted) {
    const planner::PlannedMove first = lift(result.moves[0].segment.start_mm, 0.4);
    const planner::PlannedMove second = lift(result.moves[0].segment.end_mm, 0.4);
    const planner::PlannedMove last = lift(result.moves[2].segment.end_mm, 0.4);
    result.moves.insert(result.moves.begin() + 1, {second, second});
    result.moves.insert(result.moves.begin(), first);
    result.moves.push_back(last);
    result.lift_s = from_rest_to_rest(first, kLiftBounds).duration_s();
  }
  result.bounds = bounds_of(result.moves);
  for (std::size_t i = 0; i < result.moves.size(); ++i) {
    if (is_upright(result.moves[i])) {
      result.bounds[i] = kLiftBounds;
    }
  }
  return result;
}

// Along a stretch from rest to rest, as s = 3 x² − 2 x³.
void pass(double from_mm, double to_mm, double begin_s, double duration_s,
          std::vector<Progress>& progress) {
  const auto count = static_cast<int>(duration_s / kNode_s);
  for (int i = 0; i <= count; ++i) {
    const double x = static_cast<double>(i) / count;
    const double length_mm = to_mm - from_mm;
    progress.push_back({begin_s + x * duration_s, from_mm + length_mm * x * x * (3.0 - 2.0 * x),
                        6.0 * x * (1.0 - x) * length_mm / duration_s});
  }
}

void expect_moves_in_pieces(const Path& path, const Timed& timed) {
  ASSERT_EQ(timed.pieces.size(), path.moves.size());
  std::size_t next = 0;
  for (std::size_t i = 0; i < path.moves.size(); ++i) {
    ASSERT_GT(timed.pieces[i], 0U) << i;
    ASSERT_LE(next + timed.pieces[i], timed.moves.size());
    gcode::Position at = path.moves[i].segment.start_mm;
    double sum_mm = 0.0;
    for (std::size_t k = 0; k < timed.pieces[i]; ++k, ++next) {
      const planner::PlannedMove& piece = timed.moves[next];
      EXPECT_EQ(piece.segment.start_mm, at);
      at = piece.segment.end_mm;
      sum_mm += piece.length_mm;
      EXPECT_GT(piece.duration_s(), 0.0) << i;
      EXPECT_GE(std::min(piece.start_v_mm_s, piece.end_v_mm_s), 0.0);
      EXPECT_NEAR(piece.distance_mm(piece.duration_s() * (1.0 - 1e-12)), piece.length_mm, 1e-9);
    }
    EXPECT_EQ(at, path.moves[i].segment.end_mm);
    EXPECT_NEAR(sum_mm, path.moves[i].length_mm, 1e-9) << i;
  }
  EXPECT_EQ(next, timed.moves.size());
}

TEST(TimedMoves, CoverThePathInTheTimeOfItsProgress) {
  const Path flat = path(false);
  std::vector<Progress> progress;
  pass(0.0, 7.5, 0.0, 0.11, progress);
  const Timed timed = timed_moves(flat.moves, flat.bounds, progress);
  expect_moves_in_pieces(flat, timed);
  EXPECT_NEAR(planner::duration_s(timed.moves), 0.11, 1e-9);
  // Each node of progress is the end of a piece.
  double time_s = 0.0;
  double path_mm = 0.0;
  std::size_t at = 1;
  for (const planner::PlannedMove& move : timed.moves) {
    time_s += move.duration_s();
    path_mm += move.length_mm;
    if (std::abs(path_mm - progress[at].path_mm) < 1e-6) {
      EXPECT_NEAR(time_s, progress[at].time_s, 1e-9);
      ++at;
    }
  }
  EXPECT_EQ(at, progress.size());
}

TEST(TimedMoves, RestWhereAMoveIsUpright) {
  const Path lifted = path(true);
  const double lift_s = lifted.lift_s;
  std::vector<Progress> progress;
  pass(0.0, 3.0, lift_s, 0.06, progress);
  pass(3.0, 7.5, 0.06 + 3.0 * lift_s, 0.08, progress);
  const Timed timed = timed_moves(lifted.moves, lifted.bounds, progress);
  expect_moves_in_pieces(lifted, timed);
  EXPECT_NEAR(planner::duration_s(timed.moves), 0.14 + 4.0 * lift_s, 1e-9);
  std::size_t next = 0;
  for (std::size_t i = 0; i < lifted.moves.size(); ++i) {
    if (is_upright(lifted.moves[i])) {
      EXPECT_EQ(timed.pieces[i], 1U);
      EXPECT_NEAR(timed.moves[next].length_mm, 0.4, 1e-12);
      EXPECT_NEAR(timed.moves[next].duration_s(), lift_s, 1e-12);
    }
    next += timed.pieces[i];
  }
}

TEST(TimedMoves, HaveAPieceForAMoveThatNoNodeIsOn) {
  std::vector<compensate::testing::Point> points = {{0.0, 0.0}, {3.0, 0.0}};
  for (int i = 1; i <= 5; ++i) {
    points.push_back({3.0, 0.01 * i});
  }
  points.push_back({6.0, 0.05});
  Path tiny;
  tiny.moves = plan(points, planner_limits(100.0, 2000.0, 5.0));
  tiny.bounds = bounds_of(tiny.moves);
  std::vector<Progress> progress;
  pass(0.0, 6.05, 0.0, 0.08, progress);
  const Timed timed = timed_moves(tiny.moves, tiny.bounds, progress);
  expect_moves_in_pieces(tiny, timed);
  EXPECT_NEAR(planner::duration_s(timed.moves), 0.08, 1e-9);
}

}  // namespace
}  // namespace unflex::timing
