// RepRapFirmware's own plan of a run's lines.
#include <fmt/core.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "plain_emission.hpp"
#include "planner/rrf_limits.hpp"
#include "speeds.hpp"
#include "unflex/emit/emitter.hpp"
#include "unflex/planner/rrf_planner.hpp"

namespace unflex::emit {
namespace {

using ::testing::ElementsAre;
using testing::lines_of;

EmitOptions rrf_options() {
  EmitOptions how = testing::options();
  how.interpreter = gcode::default_options(Firmware::rrf);
  how.fixed.firmware = Firmware::rrf;
  how.fixed.steps_per_mm = {80.0, 80.0, 400.0, 420.0};
  how.printer_limits = planner::testing::rrf_default_limits();
  how.run_limits = planner::testing::rrf_default_limits();
  how.run_limits.axis_max_velocity_mm_s = {1200.0, 1200.0, 20.0, 1200.0};
  how.run_limits.axis_max_accel_mm_s2 = {1e5, 1e5, 200.0, 1e5};
  how.run_limits.axis_jerk_mm_s = {1000.0, 1000.0, 10.0, 1000.0};
  how.run_limits.print_accel_mm_s2 = how.run_limits.travel_accel_mm_s2 = 1e5;
  how.run_limits.jerk_policy = 1;
  how.line_accel_mm_s2 = 1e5;
  return how;
}

// How a printer reads: by_line each line as it comes, ring_full with the queue of moves full. Then
// the last move stays in a buffer until the next move comes, or a line that waits for standstill,
// and limits that are set meanwhile hold for it (GCodes/GCodes.cpp, ReadMove).
enum class Reading { by_line, ring_full };

// The plan of an emitted text, by number of line.
std::vector<planner::PlannedMove> plan_of(const std::string& text, const EmitOptions& how,
                                          Reading reading = Reading::by_line) {
  gcode::Interpreter interpreter(how.interpreter);
  planner::RrfPlanner planner(how.printer_limits, how.fixed);
  std::vector<gcode::Segment> buffer;
  const auto empty_buffer = [&] {
    for (const gcode::Segment& segment : buffer) {
      planner.add(segment);
    }
    buffer.clear();
  };
  std::size_t number = 0;
  for (const std::string& line : lines_of(text)) {
    const gcode::Event event = interpreter.interpret({line, ++number});
    const bool is_barrier = event.kind == gcode::EventKind::barrier;
    if (line.starts_with("G1") || is_barrier) {
      empty_buffer();
    }
    planner.apply(event);
    if (is_barrier) {
      planner.stop();
    }
    buffer.insert(buffer.end(), event.segments.begin(), event.segments.end());
    if (reading == Reading::by_line) {
      empty_buffer();
    }
  }
  empty_buffer();
  planner.stop();
  std::vector<planner::PlannedMove> moves;
  planner.take(moves);
  return moves;
}

// A run's lines pass only if moves of every kind are joined (M566 P1). The move before the first
// line is planned after that line comes, and would then end at that line's speed.
TEST(RrfRun, LetsFilamentBeforeItEndAtRest) {
  const EmitOptions how = rrf_options();
  const std::string text =
      testing::emit("G28\nG90\nM83\nG1 X0 Y0 Z0.2 F6000\nG1 E1 F2400\nG1 X10 E1 F3000\nG4 P1\n",
                    how)
          .text;
  std::vector<std::string> jerks;
  for (const std::string& line : lines_of(text)) {
    if (line.starts_with("M566") || line.starts_with("G1 X10 ")) {
      jerks.push_back(line.substr(0, 6) + (line.find(" P1") != std::string::npos ? "P1" : ""));
    } else if (line.starts_with("G1 X") && !jerks.empty() && jerks.back() != "~") {
      jerks.emplace_back("~");
    }
  }
  EXPECT_THAT(jerks, ElementsAre("M566 X", "~", "M566 PP1", "~", "G1 X10", "M566 X"));
  const std::vector<planner::PlannedMove> moves = plan_of(text, how);
  const auto alone = std::ranges::find_if(moves, [](const planner::PlannedMove& move) {
    return !move.segment.moves_xy() && move.segment.delta(gcode::E) > 0.0;
  });
  ASSERT_NE(alone, moves.end());
  EXPECT_EQ(alone->end_v_mm_s, 0.0);
  EXPECT_GT(alone->cruise_v_mm_s, 20.0);
}

// A line takes as long as its length, its feed and its ramps say, because the firmware leaves no
// ramp out.
TEST(RrfRun, HasNoLineSlowerThanItSays) {
  const EmitOptions how = rrf_options();
  std::mt19937 random(11);
  std::uniform_real_distribution<double> place(0.0, 20.0);
  std::uniform_int_distribution<int> feed(600, 9000);
  std::string input = "G28\nG90\nM83\nG1 X0 Y0 Z0.2 F6000\nM204 P3000 T3000\nM201 X3000 Y3000\n";
  for (int i = 0; i < 120; ++i) {
    input += "G1 X" + std::to_string(place(random)) + " Y" + std::to_string(place(random)) +
             " E.1 F" + std::to_string(feed(random)) + "\n";
  }
  const std::string text = testing::emit(input + "G4 P1\n", how).text;
  const std::vector<std::string> lines = lines_of(text);
  const std::vector<planner::PlannedMove> moves = plan_of(text, how);
  std::size_t looked_at = 0;
  for (std::size_t i = 1; i + 1 < moves.size(); ++i) {
    const auto in_run = [&](std::size_t k) {
      return std::string_view(lines[moves[k].segment.line - 1]).find(" E") !=
             std::string_view::npos;
    };
    if (!in_run(i - 1) || !in_run(i) || !in_run(i + 1)) {
      continue;
    }
    const double v = moves[i].segment.feed_mm_s;
    const double up = std::max(0.0, v - std::min(v, moves[i - 1].segment.feed_mm_s));
    const double down = std::max(0.0, v - std::min(v, moves[i + 1].segment.feed_mm_s));
    const double says_s = (moves[i].length_mm + (up * up + down * down) / 2e5) / v;
    EXPECT_LT(moves[i].duration_s(), 1.001 * says_s + 2e-6) << lines[moves[i].segment.line - 1];
    ++looked_at;
  }
  EXPECT_GT(looked_at, 1000U);
}

// A line that is only a little faster than the one before it gets the least speed that keeps its
// ramps. Lines behind it that are much slower stay so.
TEST(RrfRun, GivesEachLineAboutTheTimeItIsToTake) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> a_little(0.0, 4.0);
  std::uniform_real_distribution<double> slower(0.5, 0.9);
  for (const double accel_mm_s2 : {5e4, 1e5, 2e5}) {
    EmitOptions how = rrf_options();
    how.line_accel_mm_s2 = accel_mm_s2;
    how.run_limits.axis_max_accel_mm_s2 = {accel_mm_s2, accel_mm_s2, 200.0, accel_mm_s2};
    how.run_limits.print_accel_mm_s2 = how.run_limits.travel_accel_mm_s2 = accel_mm_s2;
    std::vector<Stroke> strokes;
    std::vector<double> wanted_mm_s;
    double x_mm = 0.0;
    double t = 0.0;
    const auto add = [&](double duration_s, double speed_mm_s) {
      x_mm += duration_s * speed_mm_s;
      t += duration_s;
      Stroke stroke;
      stroke.end_s = t;
      stroke.place_mm.x = x_mm;
      strokes.push_back(stroke);
      wanted_mm_s.push_back(speed_mm_s);
    };
    for (int i = 0; i < 200; ++i) {
      const double even_mm_s = 30.0 + a_little(random);
      add(30e-3, even_mm_s);
      add(4e-3, even_mm_s + a_little(random));
      add(9e-3, even_mm_s * slower(random));
    }
    set_speeds({}, Passing{}, how, Grid{}, 0.0, strokes);
    for (std::size_t i = 1; i < strokes.size(); ++i) {
      // The gain that keeps a ramp is up to a ninth of a speed.
      EXPECT_NEAR(strokes[i].speed_mm_s, wanted_mm_s[i], 0.13 * wanted_mm_s[i])
          << i << " at " << accel_mm_s2;
    }
  }
}

// A slow circle with waves, as a vase is printed: the lines are a few steps long, so their speeds
// change much.
TEST(RrfRun, OfShortLinesIsOnTime) {
  const EmitOptions how = rrf_options();
  std::string input = "G28\nG90\nM83\nG1 X30 Y20 Z0.2 F6000\nM204 P1500 T1500\nG4 P1\n";
  for (int i = 1; i <= 1500; ++i) {
    const double angle = 0.03 * i;
    const double radius_mm = 10.0 + 0.7 * std::sin(9.0 * angle);
    input += fmt::format("G1 X{:.3f} Y{:.3f} E.02 F600\n", 20.0 + radius_mm * std::cos(angle),
                         20.0 + radius_mm * std::sin(angle));
  }
  const std::string text = testing::emit(input + "G4 P1\n", how).text;
  const std::vector<planner::PlannedMove> sliced = plan_of(input + "G4 P1\n", how);
  const std::vector<planner::PlannedMove> emitted = plan_of(text, how);
  std::vector<double> apart_mm;
  for (double t = 0.5; t < planner::duration_s(sliced); t += 0.05) {
    const std::array<double, 2> a = testing::plan_at(sliced, t);
    const std::array<double, 2> b = testing::plan_at(emitted, t);
    apart_mm.push_back(std::hypot(a[0] - b[0], a[1] - b[1]));
  }
  // A step, and a millisecond at 10 mm/s.
  std::ranges::sort(apart_mm);
  EXPECT_LT(apart_mm[apart_mm.size() * 9 / 10], 0.0125 + 0.01);
}

// Filament alone before and behind runs, limits of the file's own inside them.
TEST(RrfRun, KeepsEachLinesLimitsWhenTheRingIsFull) {
  const EmitOptions how = rrf_options();
  std::mt19937 random(5);
  std::uniform_real_distribution<double> place(0.0, 20.0);
  std::uniform_int_distribution<int> choice(0, 5);
  std::string input = "G28\nG90\nM83\nG1 X0 Y0 Z0.2 F6000\nM400\n";
  for (int i = 0; i < 60; ++i) {
    const int kind = choice(random);
    const std::string limits = "M204 P" + std::to_string(500 * (kind + 1)) + " T2000\n";
    input += "G1 X" + std::to_string(place(random)) + " Y" + std::to_string(place(random)) +
             " E.1 F6000\n";
    input += kind < 2 ? "G1 E-1 F2400\nG1 E1 F1500\n" : kind < 4 ? limits : "";
  }
  const std::string text = testing::emit(input + "G4 P1\n", how).text;
  const std::vector<planner::PlannedMove> as_read = plan_of(text, how);
  const std::vector<planner::PlannedMove> ring_full = plan_of(text, how, Reading::ring_full);
  ASSERT_EQ(as_read.size(), ring_full.size());
  ASSERT_GT(as_read.size(), 1000U);
  for (std::size_t i = 0; i < as_read.size(); ++i) {
    ASSERT_EQ(as_read[i].duration_s(), ring_full[i].duration_s()) << as_read[i].segment.line;
    ASSERT_EQ(as_read[i].end_v_mm_s, ring_full[i].end_v_mm_s) << as_read[i].segment.line;
  }
}

}  // namespace
}  // namespace unflex::emit
