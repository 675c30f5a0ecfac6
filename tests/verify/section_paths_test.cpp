#include "section_paths.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "replaying.hpp"
#include "track.hpp"

namespace unflex::verify {
namespace {

using Moves = std::vector<planner::PlannedMove>;

// Two moves in X of 10 mm and 20 mm at 100 mm/s, without time for the acceleration.
Moves two_moves() {
  planner::Limits limits;
  limits.max_accel_mm_s2 = 1e9;
  limits.max_velocity_mm_s = 1e4;
  return testing::plan_path(
      {{0.0, 0.0, 100.0, 0.0}, {10.0, 0.0, 100.0, 0.5}, {30.0, 0.0, 100.0, 1.0}}, limits);
}

class SectionPathsTest : public ::testing::Test {
 protected:
  static std::function<bool(planner::PlannedMove&)> hand_out(const Moves& from, std::size_t& next) {
    return [&from, &next](planner::PlannedMove& move) {
      if (next == from.size()) {
        return false;
      }
      move = from[next++];
      return true;
    };
  }

  Moves moves_ = two_moves();
  std::size_t sliced_ = 0;
  std::size_t resting_ = 0;
  std::size_t output_ = 0;
  std::size_t planned_ = 0;
  SectionPaths paths_{{.sliced = hand_out(moves_, sliced_),
                       .resting = hand_out(moves_, resting_),
                       .output =
                           [this](OutputMove& move) {
                             const bool has = hand_out(moves_, output_)(move.laid);
                             move.pushed = move.laid;
                             return has;
                           },
                       .on_planned = [this](const planner::PlannedMove&) { ++planned_; }}};
};

TEST_F(SectionPathsTest, WithoutARunTheEmittedFileIsMeasuredAgainstTheSlicedOne) {
  paths_.begin_kept();
  EXPECT_FALSE(paths_.is_run());
  EXPECT_FALSE(paths_.has_sliced_moves());
  EXPECT_EQ(&paths_.emitted(), &paths_.sliced());
  EXPECT_NEAR(paths_.sliced_until_s(0.15), 0.15, 1e-12);
  EXPECT_TRUE(paths_.has_sliced_moves());
  EXPECT_TRUE(paths_.next_sliced(0.15).has_value());
  EXPECT_FALSE(paths_.next_sliced(0.15).has_value());
}

// Its path begins with the plan, lead_in_s after the base.
TEST_F(SectionPathsTest, APlannedRunHasOneMorePathWithALeadIn) {
  paths_.begin_run(Timing::planned, 0.05, 0.0);
  EXPECT_FALSE(paths_.has_own_clock());
  EXPECT_EQ(&paths_.emitted(), &paths_.kept());
  EXPECT_NE(&paths_.emitted(), &paths_.sliced());
  EXPECT_DOUBLE_EQ(paths_.kept_lead_in_s(), 0.05);
  paths_.complete_kept();
  EXPECT_EQ(planned_, 2U);
  ReferencePath& run = paths_.emitted();
  EXPECT_NEAR(run[run.first()].start_s - run.section_start_s(), 0.05, 1e-12);
  EXPECT_NEAR(run.end_s() - run.section_start_s(), 0.35, 1e-6);
}

// The sliced file's nozzle goes on move by move, once the emitted one has passed them.
TEST_F(SectionPathsTest, AnUnplannedRunPassesWholeMoves) {
  paths_.begin_run(Timing::unplanned, 0.05, 0.0);
  EXPECT_TRUE(paths_.has_own_clock());
  EXPECT_NE(&paths_.emitted(), &paths_.kept());
  EXPECT_DOUBLE_EQ(paths_.kept_lead_in_s(), 0.0);
  ReferencePath& run = paths_.emitted();
  run.extend_to(run.section_start_s() + 1.0);
  const double first_end_s = run[run.first()].end_s;
  EXPECT_NEAR(paths_.sliced_until_s(first_end_s - 1e-3), 0.0, 1e-12);
  EXPECT_NEAR(paths_.sliced_until_s(first_end_s + 1e-3), 0.1, 1e-6);
  EXPECT_TRUE(paths_.next_sliced(0.11).has_value());
  // Both paths have had both moves, whoever asked for them first.
  paths_.complete_kept();
  EXPECT_EQ(paths_.kept().end() - paths_.kept().first(), 2U);
  EXPECT_EQ(resting_, 2U);
}

// The emitted moves that were read ahead for the timing are still handed out, each once.
TEST_F(SectionPathsTest, AFreeRunReadsTheEmittedMovesAhead) {
  paths_.begin_run(Timing::free, 0.0, 1e-4);
  EXPECT_TRUE(paths_.is_free());
  paths_.emitted().extend_to(paths_.emitted().section_start_s() + 1.0);
  EXPECT_EQ(output_, 2U);
  EXPECT_EQ(planned_, 0U);
  OutputMove move;
  ASSERT_TRUE(paths_.next_output(move));
  EXPECT_DOUBLE_EQ(move.pushed.segment.end_mm[gcode::X], 10.0);
  ASSERT_TRUE(paths_.next_output(move));
  EXPECT_DOUBLE_EQ(move.pushed.segment.end_mm[gcode::X], 30.0);
  EXPECT_FALSE(paths_.next_output(move));
}

TEST(SwitchingTest, LinesInARowAreOneStop) {
  Switching switching;
  EXPECT_DOUBLE_EQ(switching.stop(0.2), 0.2);
  EXPECT_DOUBLE_EQ(switching.stop(0.3), 0.3 - 0.2);
  EXPECT_DOUBLE_EQ(switching.stop(0.1), 0.0);
  EXPECT_DOUBLE_EQ(switching.since_motion_s(), 0.3);
  switching.move();
  EXPECT_DOUBLE_EQ(switching.stop(0.1), 0.1);
}

}  // namespace
}  // namespace unflex::verify
