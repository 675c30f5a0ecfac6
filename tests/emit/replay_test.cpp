// The printer plans the emitted lines anew; these tests check its plan.
#include <fmt/core.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "plain_emission.hpp"
#include "strokes.hpp"
#include "unflex/planner/klipper_planner.hpp"

namespace unflex::emit {
namespace {

using gcode::E;
using gcode::X;
using gcode::Y;
using gcode::Z;
using testing::options;

constexpr const char* kHead = "G90\nM83\nG1 X100 Y100 Z0.2 F6000\n";

// A drawing of straight lines in relative extrusion, `seconds` or a little more long.
std::string drawing(unsigned seed, double seconds, const std::string& every_tenth_line = "") {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> place(80.0, 120.0);
  std::uniform_int_distribution<int> feed(1200, 6000);
  std::uniform_real_distribution<double> per_mm(0.030, 0.035);
  double x = 100.0;
  double y = 100.0;
  double took_s = 0.0;
  std::string text = kHead;
  for (int i = 0; took_s < seconds; ++i) {
    // Some long lines, many short ones.
    const double share = i % 3 == 0 ? 1.0 : 0.03;
    const double to_x = std::round((x + share * (place(random) - x)) * 1e3) / 1e3;
    const double to_y = std::round((y + share * (place(random) - y)) * 1e3) / 1e3;
    const double length = std::hypot(to_x - x, to_y - y);
    const int f = feed(random);
    text += fmt::format("G1 X{:.3f} Y{:.3f} E{:.5f} F{}\n", to_x, to_y, per_mm(random) * length, f);
    text += i % 10 == 9 ? every_tenth_line : "";
    took_s += length / f * 60.0;
    x = to_x;
    y = to_y;
  }
  return text;
}

// The moves that the printer plans for a text.
std::vector<planner::PlannedMove> planned(const std::string& text, const EmitOptions& how) {
  gcode::Interpreter interpreter(how.interpreter);
  planner::KlipperPlanner planner(how.printer_limits, how.fixed);
  for (const std::string& line : testing::lines_of(text)) {
    const gcode::Event event = interpreter.interpret({line, 0});
    planner.apply(event);
    for (const gcode::Segment& segment : event.segments) {
      planner.add(segment);
    }
    if (event.kind == gcode::EventKind::barrier) {
      planner.stop();
    }
  }
  planner.stop();
  std::vector<planner::PlannedMove> moves;
  planner.take(moves);
  return moves;
}

// One run as the emitter meant it, and as the printer plans it.
struct Replay {
  Replay(const std::string& text, const EmitOptions& how) {
    std::istringstream stream(text);
    run::PieceReader reader(stream, "in", how.interpreter, how.printer_limits, how.fixed);
    Emitter emitter(how);
    std::string out;
    for (run::Piece piece; reader.next(piece).value();) {
      if (!piece.is_run) {
        for (const gcode::Event& event : piece.events) {
          emitter.line(event, out);
        }
        continue;
      }
      run = piece;
      const dynamics::BaseTrajectory base = testing::plan_as_base(run.moves);
      const Run to_emit{&run.events, &run.move_counts, &run.moves, &base, 0.0};
      Grid grid;
      grid.speed_factor = emitter.printer().state().speed_factor;
      meant = strokes(to_emit, grid, how);
      emitter.run(to_emit, plan_run(to_emit, emitter.run_start(), how), out);
    }
    moves = planned(out, how);
    moves.erase(moves.begin(), moves.end() - static_cast<std::ptrdiff_t>(meant.size()));
  }

  // Largest difference between the end of a line as planned and as meant.
  [[nodiscard]] double worst_clock_error_s() const {
    double t = 0.0;
    double worst = 0.0;
    for (std::size_t i = 0; i < meant.size(); ++i) {
      t += moves[i].duration_s();
      worst = std::max(worst, std::abs(t - meant[i].end_s));
    }
    return worst;
  }

  run::Piece run;
  std::vector<Stroke> meant;
  std::vector<planner::PlannedMove> moves;
};

TEST(Replay, KeepsTheClockOfALongRun) {
  const Replay replay(drawing(1, 55.0), options());
  ASSERT_GT(replay.meant.back().end_s, 50.0);
  ASSERT_GT(replay.meant.size(), 2000U);
  EXPECT_LE(replay.worst_clock_error_s(), 40e-6);
}

TEST(Replay, KeepsTheClockOfManyRuns) {
  for (unsigned seed = 2; seed <= 30; ++seed) {
    EXPECT_LE(Replay(drawing(seed, 2.0), options()).worst_clock_error_s(), 20e-6) << seed;
  }
}

TEST(Replay, KeepsTheClockWithAccelerationCommandsInside) {
  const Replay replay(drawing(3, 20.0, "M204 S900\n"), options());
  EXPECT_LE(replay.worst_clock_error_s(), 20e-6);
}

TEST(Replay, KeepsTheClockUnderASpeedFactor) {
  for (const char* factor : {"M220 S37\n", "M220 S250\n"}) {
    std::string text = drawing(4, 10.0);
    text.insert(text.find("G1 X"), factor);
    EXPECT_LE(Replay(text, options()).worst_clock_error_s(), 20e-6) << factor;
  }
}

TEST(Replay, EndsEveryLineWhereItIsMeant) {
  const Replay replay(drawing(5, 20.0), options());
  for (std::size_t i = 0; i < replay.meant.size(); ++i) {
    ASSERT_NEAR(replay.moves[i].segment.end_mm[X], replay.meant[i].place_mm.x, 1e-9);
    ASSERT_NEAR(replay.moves[i].segment.end_mm[Y], replay.meant[i].place_mm.y, 1e-9);
  }
}

TEST(Replay, LaysTheFilamentOfEveryRunWithinOneStep) {
  for (const char* flow : {"", "M221 S93\n", "M221 S133\n"}) {
    for (unsigned seed = 40; seed < 50; ++seed) {
      std::string text = drawing(seed, 3.0);
      text.insert(text.find("G1 X"), flow);
      const Replay replay(text, options());
      double laid = 0.0;
      for (std::size_t i = 0; i < replay.meant.size(); ++i) {
        laid += replay.moves[i].segment.delta(E);
        // No error accumulates during the run either.
        ASSERT_NEAR(laid, replay.meant[i].e_mm, 0.7e-5) << flow << "line " << i;
      }
      const double sliced =
          replay.run.moves.back().segment.end_mm[E] - replay.run.moves.front().segment.start_mm[E];
      EXPECT_NEAR(laid, sliced, 1e-5) << flow;
    }
  }
}

// Klipper reduces speed at junctions where filament per mm jumps. The lines of one move must not
// have such jumps.
TEST(Replay, LosesNoTimeToTheExtruder) {
  EmitOptions how = options();
  const Replay replay(drawing(6, 20.0), how);
  how.fixed.instantaneous_corner_velocity_mm_s = 1e9;
  const Replay unlimited(drawing(6, 20.0), how);
  EXPECT_NEAR(planner::duration_s(replay.moves), planner::duration_s(unlimited.moves), 20e-6);
}

}  // namespace
}  // namespace unflex::emit
