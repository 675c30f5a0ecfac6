#include "replay.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

namespace unflex::verify {
namespace {

using ::testing::ElementsAre;

constexpr char kStart[] = "G90\nM83\nG1 Z0.2 F600\nG1 X10 Y10 F6000\n";  // three sections: run, Z
                                                                         // move, run, first XY move

class Sections : public ::testing::Test {
 protected:
  // One word per section: its kind, and for runs the number of moves.
  std::vector<std::string> walk(const std::string& text, ReplayedFile file = ReplayedFile::sliced) {
    std::istringstream stream(text);
    Replay replay(stream, "file", {}, {}, {}, file);
    std::vector<std::string> words;
    for (;;) {
      planner::PlannedMove move;
      std::size_t moves = 0;
      const bool any = replay.has_move();
      const bool compensated = replay.section().compensated;
      while (replay.next(move)) {
        ++moves;
        duration_s_ += move.duration_s();
      }
      EXPECT_EQ(any, moves > 0);
      switch (replay.section().kind) {
        case SectionKind::run:
          words.push_back((compensated ? "compensated" : "run") + std::to_string(moves));
          break;
        case SectionKind::move:
          words.push_back("move" + std::to_string(moves));
          break;
        case SectionKind::barrier:
          words.push_back("barrier");
          break;
        case SectionKind::border:
          words.push_back("border");
          break;
        case SectionKind::end:
          words.push_back("end");
          lines_ = replay.lines().size();
          return words;
      }
      replay.next_section();
    }
  }

  std::size_t lines_ = 0;
  double duration_s_ = 0.0;
};

TEST_F(Sections, OfAnEmptyFileAreAnEmptyRunAndTheEnd) {
  EXPECT_THAT(walk(""), ElementsAre("run0", "end"));
}

TEST_F(Sections, RunsEndAtRetractionsLiftsAndBarriers) {
  EXPECT_THAT(walk(std::string(kStart) + "G1 X20 E1\n;comment\nM204 S1000\nG1 Y20 E1\n"  // run
                                         "G1 E-2 F1800\n"
                                         "G1 Z1\n"
                                         "G1 X5 F9000\nG1 X4\n"  // run
                                         "G4 P100\n"
                                         "G1 X3 E-.2\n"),
              ElementsAre("run0", "move1", "run0", "move1", "run2", "move1", "run0", "move1",
                          "run2", "barrier", "run0", "move1", "run0", "end"));
  // Lines that are no section: two modes, a comment, a limit, and the four moves of the runs.
  EXPECT_EQ(lines_, 8U);
}

TEST_F(Sections, OnlyTheOutputAnnouncesCompensatedRuns) {
  const std::string text = std::string(kStart) + ";unflex run\nG1 X20 E1\nG1 X21 E1\n";
  EXPECT_THAT(walk(text, ReplayedFile::emitted),
              ElementsAre("run0", "move1", "run0", "move1", "compensated2", "end"));
  EXPECT_THAT(walk(text), ElementsAre("run0", "move1", "run0", "move1", "run2", "end"));
}

TEST_F(Sections, AnAnnouncementHoldsOverTheStopThatSetsUpTheRun) {
  EXPECT_THAT(walk(std::string(kStart) + ";unflex run\nSET_INPUT_SHAPER SHAPER_FREQ_X=0\nG1 X20 "
                                         "E1\n;unflex end\nG1 Z2\nG1 X10\n",
                   ReplayedFile::emitted),
              ElementsAre("run0", "move1", "run0", "move1", "compensated0", "barrier",
                          "compensated1", "move1", "run1", "end"));
}

TEST_F(Sections, ACompensatedRunLastsUntilItsEndIsAnnounced) {
  const std::string run = ";unflex run\nG1 X20 E1\nG1 X20.003 Z0.2002\n";
  const std::string steep = "G1 X20.004 Z0.2003\n";
  EXPECT_THAT(walk(kStart + run, ReplayedFile::emitted),
              ElementsAre("run0", "move1", "run0", "move1", "compensated2", "end"));
  EXPECT_THAT(
      walk(kStart + run + ";unflex end\n" + steep, ReplayedFile::emitted),
      ElementsAre("run0", "move1", "run0", "move1", "compensated2", "move1", "run0", "end"));
  EXPECT_THAT(walk(kStart + run),
              ElementsAre("run0", "move1", "run0", "move1", "run1", "move1", "run0", "end"));
}

TEST_F(Sections, MovesOfNoLengthAreMotionAndPartOfTheRun) {
  std::istringstream stream(std::string(kStart) + "G1 X10 Y10\nG1 F1200\n");
  Replay replay(stream, "file", {}, {}, {}, ReplayedFile::sliced);
  while (replay.section().kind != SectionKind::end) {
    planner::PlannedMove move;
    while (replay.next(move)) {
    }
    replay.next_section();
  }
  ASSERT_EQ(replay.lines().size(), 4U);
  EXPECT_TRUE(replay.lines()[2].motion);
  EXPECT_FALSE(replay.lines()[3].motion);
  EXPECT_EQ(replay.lines_read(), 6U);
}

TEST_F(Sections, JoinedOverABarrierAreOneRun) {
  std::istringstream stream(std::string(kStart) +
                            "G1 X20 E1\nSET_INPUT_SHAPER SHAPER_FREQ_X=0\n;unflex run\nG1 X30\n");
  Replay replay(stream, "file", {}, {}, {}, ReplayedFile::emitted);
  planner::PlannedMove move;
  for (int i = 0; i < 4; ++i) {
    while (replay.next(move)) {
    }
    replay.next_section();
  }
  ASSERT_TRUE(replay.next(move));
  ASSERT_FALSE(replay.has_move());
  EXPECT_TRUE(replay.following().may_be_added);
  replay.join_over_barrier();
  ASSERT_TRUE(replay.has_move());
  EXPECT_TRUE(replay.section().compensated);
  EXPECT_EQ(replay.section().kind, SectionKind::run);
  ASSERT_TRUE(replay.next(move));
  EXPECT_DOUBLE_EQ(move.segment.end_mm[gcode::X], 30.0);
}

TEST_F(Sections, TheMachineRestsAtEveryBarrier) {
  walk(std::string(kStart) + "G1 X110 F6000\n");
  const double together_s = duration_s_;
  duration_s_ = 0.0;
  walk(std::string(kStart) + "G1 X60 F6000\nG4 P0\nG1 X110\n");
  // 100 mm/s at 5000 mm/s²: stopping and starting costs v/a.
  EXPECT_NEAR(duration_s_ - together_s, 0.02, 1e-9);
}

TEST_F(Sections, TheRestingPlanStopsBetweenSections) {
  // A wipe in the direction of the line before it, which the machine enters at full speed.
  std::istringstream stream(std::string(kStart) + "G4 P1\nG1 X60 E1\nG1 X70 E-.2\n");
  Replay replay(stream, "file", {}, {}, {}, ReplayedFile::sliced);
  std::vector<planner::PlannedMove> moves;
  std::vector<planner::PlannedMove> resting;
  for (; replay.section().kind != SectionKind::end; replay.next_section()) {
    planner::PlannedMove move;
    while (replay.next(move)) {
      moves.push_back(move);
    }
    while (replay.next_resting(move)) {
      resting.push_back(move);
    }
  }
  ASSERT_EQ(moves.size(), 4U);
  ASSERT_EQ(resting.size(), 4U);
  EXPECT_GT(moves[2].end_v_mm_s, 1.0);
  EXPECT_EQ(resting[2].start_v_mm_s, 0.0);
  EXPECT_EQ(resting[2].end_v_mm_s, 0.0);
  EXPECT_EQ(resting[2].segment.end_mm, moves[2].segment.end_mm);
}

TEST_F(Sections, WhatIsNotAskedForOfTheRestingPlanIsDropped) {
  std::istringstream stream(std::string(kStart) + "G1 X20\nG1 X30\nM400\nG1 X40\n");
  Replay replay(stream, "file", {}, {}, {}, ReplayedFile::sliced);
  planner::PlannedMove move;
  while (replay.section().id < 6) {
    while (replay.next(move)) {
    }
    replay.next_section();
  }
  ASSERT_TRUE(replay.next_resting(move));
  EXPECT_DOUBLE_EQ(move.segment.end_mm[gcode::X], 40.0);
}

TEST(KnownAddition, ComprisesTheFormsOfTheEmitterOnly) {
  for (const char* line :
       {";unflex run", ";unflex 0.1", "SET_VELOCITY_LIMIT ACCEL=1000000", "M83", "M82 ;unflex",
        "G90", "G91", "G21", "G20", "G92 E1.25", "G1 F1200", "SET_INPUT_SHAPER SHAPER_FREQ_X=0",
        "UNFLEX_CHECKPOINT", "UNFLEX_CHECKPOINT RUN=1 SHAPER_FREQ_X=45"}) {
    EXPECT_TRUE(is_known_addition(line, Firmware::klipper)) << line;
  }
  for (const char* line : {"; unflex run", "G92 X0", "G92", "G92 E0 X1", "G1 F1200 X1", "G1 X1",
                           "M106 S0", "M83 S1", "G28", "SET_PIN PIN=x VALUE=1", "", "G0 F100"}) {
    EXPECT_FALSE(is_known_addition(line, Firmware::klipper)) << line;
  }
}

}  // namespace
}  // namespace unflex::verify
