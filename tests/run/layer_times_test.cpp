#include "unflex/run/layer_times.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace unflex::run {
namespace {

// A piece that lasts so long as sliced, and begins with the comment.
std::shared_ptr<RunJob> job(bool is_run, double sliced_s, const std::string& comment = {}) {
  auto result = std::make_shared<RunJob>();
  result->piece.is_run = is_run;
  planner::PlannedMove move;
  move.cruise_s = sliced_s;
  result->piece.moves = {move};
  gcode::Event event;
  event.line.text = comment + "\n";
  result->piece.events = {event};
  result->piece.move_counts = {1};
  result->stage = is_run ? Stage::read : Stage::lined;
  return result;
}

void set_time(RunJob& job, double new_s) {
  planner::PlannedMove move;
  move.cruise_s = new_s;
  job.retimed = NewTiming{{move}, {1}};
  job.stage = Stage::timed;
}

TEST(LayerTimes, StretchTheRunsOfALayerEvenly) {
  LayerTimes layers(10.0);
  const auto mark = job(false, 1.0, ";LAYER:0");
  const auto first = job(true, 8.0);
  const auto between = job(false, 2.0);
  const auto second = job(true, 12.0);
  const auto last = job(true, 3.0);
  const auto next = job(false, 1.0, ";LAYER:1");
  for (const auto& piece : {mark, first, between, second, last, next}) {
    layers.add(piece);
  }
  EXPECT_EQ(mark->stretch, 1.0);
  set_time(*first, 1.0);
  set_time(*second, 2.0);
  last->stage = Stage::timed;  // no other timing was found
  const auto of_next_layer = job(true, 5.0);
  EXPECT_FALSE(layers.can_settle());
  EXPECT_TRUE(layers.needs_more());
  layers.add(of_next_layer);
  EXPECT_TRUE(layers.can_settle());
  layers.settle();
  // 10 s less 2, 3 and 1 s that stay as they are, over 3 s.
  ASSERT_TRUE(first->stretch && second->stretch && last->stretch);
  EXPECT_NEAR(*first->stretch, 4.0 / 3.0, 1e-12);
  EXPECT_NEAR(*second->stretch, 4.0 / 3.0, 1e-12);
  EXPECT_EQ(*last->stretch, 1.0);
  EXPECT_FALSE(of_next_layer->stretch);
  EXPECT_FALSE(layers.needs_more());
}

TEST(LayerTimes, MakeNoLayerLongerThanItWasSliced) {
  LayerTimes layers(10.0);
  layers.add(job(false, 1.0, ";LAYER:0"));
  const auto run = job(true, 6.0);
  layers.add(run);
  set_time(*run, 4.0);
  layers.settle();
  EXPECT_FALSE(run->stretch);
  layers.end();
  layers.settle();
  ASSERT_TRUE(run->stretch);
  EXPECT_NEAR(*run->stretch, 1.5, 1e-12);
}

TEST(LayerTimes, AreKnownOnceTheyAreLongEnough) {
  LayerTimes layers(10.0);
  layers.add(job(false, 1.0, ";LAYER:0"));
  const auto first = job(true, 30.0);
  const auto second = job(true, 30.0);
  layers.add(first);
  layers.add(second);
  EXPECT_FALSE(layers.needs_more());
  set_time(*second, 11.0);
  layers.settle();
  EXPECT_EQ(first->stretch, 1.0);
  EXPECT_EQ(second->stretch, 1.0);
  const auto third = job(true, 1.0);
  layers.add(third);
  EXPECT_EQ(third->stretch, 1.0);
}

TEST(LayerTimes, StretchAllPartsOfARunOrNone) {
  LayerTimes layers(100.0);
  layers.add(job(false, 1.0, ";LAYER:0"));
  const auto begin = job(true, 30.0, ";LAYER:1");
  const auto end = job(true, 30.0);
  begin->piece.after = end->piece.moves;
  end->piece.before = begin->piece.moves;
  const auto next = job(true, 20.0);
  for (const auto& piece : {begin, end, next}) {
    layers.add(piece);
  }
  set_time(*begin, 10.0);
  end->stage = Stage::timed;
  layers.settle();
  // The run counts for the layer in which it begins, which lasts 60 s as sliced.
  ASSERT_TRUE(begin->stretch && end->stretch);
  EXPECT_NEAR(*begin->stretch, 1.5, 1e-12);
  EXPECT_NEAR(*end->stretch, 1.5, 1e-12);
  EXPECT_FALSE(next->stretch);
  stretch(*end);
  EXPECT_NEAR(planner::duration_s(end->retimed->moves), 45.0, 1e-12);
  EXPECT_NEAR(planner::duration_s(end->piece.before), 45.0, 1e-12);
}

TEST(LayerTimes, LeaveAKeptRunAndWhatIsBeforeTheFirstLayer) {
  LayerTimes layers(10.0);
  const auto early = job(true, 3.0, ";LAYER:0");
  layers.add(early);
  EXPECT_EQ(early->stretch, 1.0);
  const auto kept = job(true, 3.0);
  kept->failure = "kept";
  kept->stage = Stage::lined;
  const auto run = job(true, 5.0);
  layers.add(kept);
  layers.add(run);
  set_time(*run, 2.0);
  layers.end();
  layers.settle();
  EXPECT_EQ(kept->stretch, 1.0);
  EXPECT_NEAR(run->stretch.value_or(0.0), 2.5, 1e-12);
}

}  // namespace
}  // namespace unflex::run
