#include "pieces.hpp"

#include <gtest/gtest.h>

#include <numeric>
#include <vector>

#include "../compensate/playback.hpp"

namespace unflex::timing {
namespace {

using compensate::testing::plan;
using compensate::testing::planner_limits;

constexpr double kEnds_s[] = {4e-3, 8e-3};

TEST(Pieces, CoverEachMoveWithItsFilament) {
  const auto path = plan({{0.0, 0.0}, {30.0, 0.0}, {30.0, 0.3}, {20.0, 0.3, false}},
                         planner_limits(100.0, 3000.0, 5.0));
  const std::vector<MoveBounds> bounds(path.size(), {.speed_mm_s = 100.0});
  const Pieces pieces = in_pieces(path, bounds, kEnds_s);
  EXPECT_EQ(pieces.counts, (std::vector<std::size_t>{5, 1, 5}));
  ASSERT_EQ(pieces.moves.size(), 11U);
  std::size_t next = 0;
  for (std::size_t i = 0; i < path.size(); ++i) {
    double length_mm = 0.0;
    double filament_mm = 0.0;
    gcode::Position at = path[i].segment.start_mm;
    for (std::size_t k = 0; k < pieces.counts[i]; ++k, ++next) {
      const planner::PlannedMove& piece = pieces.moves[next];
      EXPECT_EQ(piece.segment.start_mm, at);
      at = piece.segment.end_mm;
      length_mm += piece.length_mm;
      filament_mm += piece.segment.delta(gcode::E);
    }
    EXPECT_EQ(at, path[i].segment.end_mm);
    EXPECT_NEAR(length_mm, path[i].length_mm, 1e-12);
    EXPECT_NEAR(filament_mm, path[i].segment.delta(gcode::E), 1e-12);
  }
  // 4 ms and 8 ms at 100 mm/s.
  EXPECT_NEAR(pieces.moves[0].length_mm, 0.4, 1e-12);
  EXPECT_NEAR(pieces.moves[1].length_mm, 0.8, 1e-12);
  EXPECT_NEAR(pieces.moves[4].length_mm, 0.4, 1e-12);
}

TEST(Pieces, BoundTheEndsOfTheMoveAlone) {
  const auto path = plan({{0.0, 0.0}, {30.0, 0.0}}, planner_limits(100.0, 3000.0, 5.0));
  const std::vector<MoveBounds> bounds = {
      {.speed_mm_s = 100.0, .start_speed_mm_s = 3.0, .end_speed_mm_s = 7.0}};
  const Pieces pieces = in_pieces(path, bounds, kEnds_s);
  EXPECT_EQ(pieces.bounds.front().start_speed_mm_s, 3.0);
  EXPECT_EQ(pieces.bounds.front().end_speed_mm_s, planner::kNoLimit);
  EXPECT_EQ(pieces.bounds[1].start_speed_mm_s, planner::kNoLimit);
  EXPECT_EQ(pieces.bounds.back().end_speed_mm_s, 7.0);
}

TEST(Pieces, OfOneSpeedAreJoined) {
  const auto path =
      plan({{0.0, 0.0}, {30.0, 0.0}, {60.0, 0.0}}, planner_limits(100.0, 3000.0, 5.0));
  const std::vector<MoveBounds> bounds(2, {.speed_mm_s = 50.0});
  Pieces pieces = in_pieces(path, bounds, kEnds_s);
  for (planner::PlannedMove& move : pieces.moves) {
    move.start_v_mm_s = move.cruise_v_mm_s = move.end_v_mm_s = 50.0;
    move.accel_s = move.decel_s = 0.0;
    move.cruise_s = move.length_mm / 50.0;
  }
  pieces.moves[0].start_v_mm_s = 40.0;
  join_even(pieces.moves, pieces.counts);
  EXPECT_EQ(pieces.counts, (std::vector<std::size_t>{2, 1}));
  EXPECT_NEAR(planner::duration_s(pieces.moves), 60.0 / 50.0, 1e-12);
  EXPECT_EQ(pieces.moves[1].segment.end_mm, path[0].segment.end_mm);
}

}  // namespace
}  // namespace unflex::timing
