#include "progress_timing.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "replaying.hpp"

namespace unflex::verify {
namespace {

using Moves = std::vector<planner::PlannedMove>;
using testing::Point;

planner::Limits quick() {
  planner::Limits limits;
  limits.max_accel_mm_s2 = 1e7;
  limits.max_velocity_mm_s = 1e4;
  return limits;
}

// What the timing makes of the sliced moves.
std::vector<ReferenceMove> timed(const Moves& sliced, const Moves& emitted,
                                 double rounding_mm = 1.5e-5) {
  std::size_t next_sliced = 0;
  std::size_t next_emitted = 0;
  const auto hand_out = [](const Moves& from, std::size_t& next) {
    return [&from, &next](planner::PlannedMove& move) {
      if (next == from.size()) {
        return false;
      }
      move = from[next++];
      return true;
    };
  };
  ProgressTiming timing(hand_out(sliced, next_sliced), hand_out(emitted, next_emitted));
  timing.begin(rounding_mm);
  std::vector<ReferenceMove> result;
  ReferenceMove move;
  while (timing.next(move)) {
    result.push_back(std::move(move));
  }
  return result;
}

double duration_s(const std::vector<ReferenceMove>& moves) {
  double sum_s = 0.0;
  for (const ReferenceMove& move : moves) {
    sum_s += move.duration_s();
  }
  return sum_s;
}

// The lines of a base that goes along a polyline in pieces of piece_mm at a speed of its own.
Moves lines(const std::vector<Point>& corners, double piece_mm, double filament_step_mm = 0.0) {
  std::vector<Point> points = {corners.front()};
  double owed_mm = 0.0;
  for (std::size_t i = 1; i < corners.size(); ++i) {
    const double dx = corners[i].x_mm - corners[i - 1].x_mm;
    const double dy = corners[i].y_mm - corners[i - 1].y_mm;
    const int count = std::max(1, static_cast<int>(std::hypot(dx, dy) / piece_mm));
    for (int k = 1; k <= count; ++k) {
      const double share = static_cast<double>(k) / count;
      owed_mm += corners[i].filament_mm / count;
      const double lays_mm = filament_step_mm > 0.0
                                 ? std::floor(owed_mm / filament_step_mm) * filament_step_mm
                                 : owed_mm;
      owed_mm -= lays_mm;
      points.push_back({corners[i - 1].x_mm + share * dx, corners[i - 1].y_mm + share * dy,
                        corners[i].feed_mm_s, lays_mm});
    }
  }
  return testing::plan_path(points, quick());
}

// A line, travel to the side, a line back, and a short one behind more travel.
std::vector<Point> tour(double feed_mm_s) {
  return {{0.0, 0.0, feed_mm_s},      {10.0, 0.0, feed_mm_s, 0.4}, {10.0, 5.0, feed_mm_s},
          {0.0, 5.0, feed_mm_s, 0.4}, {0.0, 7.0, feed_mm_s},       {0.3, 7.0, feed_mm_s, 0.012}};
}

TEST(ProgressTiming, IsThatOfTheEmittedFile) {
  const Moves sliced = testing::plan_path(tour(20.0), quick());
  for (const double feed_mm_s : {10.0, 50.0, 200.0}) {
    const Moves emitted = lines(tour(feed_mm_s), 0.1);
    const std::vector<ReferenceMove> result = timed(sliced, emitted);
    ASSERT_EQ(result.size(), sliced.size());
    for (std::size_t i = 0; i < result.size(); ++i) {
      EXPECT_EQ(result[i].move.segment.end_mm, sliced[i].segment.end_mm);
      EXPECT_NEAR(result[i].duration_s(), sliced[i].length_mm / feed_mm_s, 0.15 / feed_mm_s) << i;
      EXPECT_NEAR(result[i].timing.back().covered_mm, sliced[i].length_mm, 1e-6);
      EXPECT_TRUE(std::ranges::is_sorted(result[i].timing, {}, &Passage::covered_mm));
      EXPECT_TRUE(std::ranges::is_sorted(result[i].timing, {}, &Passage::time_s));
    }
    EXPECT_NEAR(duration_s(result), planner::duration_s(emitted), 1e-9);
  }
}

// A base that slows down on the way is followed there.
TEST(ProgressTiming, FollowsTheBaseWithinAMove) {
  const Moves sliced = testing::plan_path({{0.0, 0.0, 10.0}, {10.0, 0.0, 10.0, 0.4}}, quick());
  Moves emitted = lines({{0.0, 0.0, 100.0}, {4.0, 0.0, 100.0, 0.16}, {10.0, 0.0, 20.0, 0.24}}, 0.1);
  const std::vector<ReferenceMove> result = timed(sliced, emitted);
  ASSERT_EQ(result.size(), 1U);
  for (const Passage& passage : result[0].timing) {
    const double expected_mm =
        passage.time_s < 0.04 ? 100.0 * passage.time_s : 4.0 + 20.0 * (passage.time_s - 0.04);
    EXPECT_NEAR(passage.covered_mm, expected_mm, 0.05) << passage.time_s;
  }
}

// Marlin lays filament in whole steps, 0.002 mm each, so a move of 0.3 mm has six.
TEST(ProgressTiming, IsNotLostWhereFilamentComesInSteps) {
  std::vector<Point> points = {{0.0, 0.0, 20.0}};
  for (int i = 0; i < 100; ++i) {
    points.push_back({points.back().x_mm + 0.3, 0.0, 20.0, 0.012});
    points.push_back({points.back().x_mm + 0.2, 0.4 * (i % 2), 20.0});
    points.push_back({points.back().x_mm + 0.2, 0.0, 20.0});
  }
  const Moves sliced = testing::plan_path(points, quick());
  for (Point& point : points) {
    point.feed_mm_s = 60.0;
  }
  const Moves emitted = lines(points, 0.05, 0.002);
  const std::vector<ReferenceMove> result = timed(sliced, emitted, 0.003);
  ASSERT_EQ(result.size(), sliced.size());
  double time_s = 0.0;
  double should_s = 0.0;
  for (std::size_t i = 0; i < result.size(); ++i) {
    time_s += result[i].duration_s();
    should_s += sliced[i].length_mm / 60.0;
    EXPECT_NEAR(time_s, should_s, 0.25 / 60.0) << i;
  }
}

TEST(ProgressTiming, KeepsToItsPlaceWhereThePathComesBack) {
  // Three times round a circle of 1 mm, which no place of the base tells apart.
  std::vector<Point> points = {{1.0, 0.0, 20.0}};
  for (int i = 1; i <= 60; ++i) {
    const double angle = 2.0 * 3.14159265358979 * i / 20.0;
    points.push_back({std::cos(angle), std::sin(angle), 20.0, 0.0125});
  }
  const Moves sliced = testing::plan_path(points, quick());
  const Moves emitted = lines(points, 0.05);
  double time_s = 0.0;
  double should_s = 0.0;
  for (const ReferenceMove& move : timed(sliced, emitted)) {
    time_s += move.duration_s();
    should_s += move.move.length_mm / 20.0;
    EXPECT_NEAR(time_s, should_s, 0.4 / 20.0);
  }
}

TEST(ProgressTiming, PassesAsSlicedWhatIsNeverReached) {
  const Moves sliced = testing::plan_path(tour(20.0), quick());
  Moves emitted = lines(tour(50.0), 0.1);
  emitted.resize(50);
  const std::vector<ReferenceMove> result = timed(sliced, emitted);
  ASSERT_EQ(result.size(), sliced.size());
  EXPECT_NEAR(duration_s(result), 5.0 / 50.0 + 22.3 / 20.0, 0.02);
}

TEST(ProgressTiming, EndsNotBeforeTheLastFilament) {
  const Moves sliced = testing::plan_path({{0.0, 0.0, 10.0}, {10.0, 0.0, 10.0, 0.4}}, quick());
  Moves emitted = lines({{0.0, 0.0, 50.0}, {10.0, 0.0, 50.0, 0.39}}, 0.1);
  // The base is there, and the last filament comes while it turns a little.
  const Moves rest = lines({{10.0, 0.0, 50.0}, {10.1, 0.0, 50.0}, {10.0, 0.0, 50.0, 0.01}}, 0.05);
  emitted.insert(emitted.end(), rest.begin(), rest.end());
  EXPECT_GT(duration_s(timed(sliced, emitted)), 10.0 / 50.0 + 1e-3);
}

}  // namespace
}  // namespace unflex::verify
