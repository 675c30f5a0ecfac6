#include "unflex/run/judge.hpp"

#include <fmt/core.h>
#include <gtest/gtest.h>

#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include "unflex/run/nozzle_motion.hpp"
#include "unflex/run/piece_reader.hpp"

namespace unflex::run {
namespace {

verify::Rules rules() {
  verify::Rules rules;
  rules.nozzle = {dynamics::from_frequency(45.0, 0.06), dynamics::from_frequency(30.0, 0.1), 1e-4,
                  0.5};
  return rules;
}

// The pieces of a text.
std::vector<Piece> pieces_of(const std::string& text) {
  std::istringstream stream(text);
  PieceReader reader(stream, "in.gcode", {}, {}, {});
  std::vector<Piece> pieces(1);
  while (reader.next(pieces.back()).value()) {
    pieces.emplace_back();
  }
  pieces.pop_back();
  return pieces;
}

// A run (a sharp corner, extruding or not) and the state the printer is in before it.
struct Corner {
  explicit Corner(bool extruding) {
    const std::string head = "G90\nM83\nG1 X0 Y0 Z0.2 F6000\n";
    const std::string filament = extruding ? " E0.5" : "";
    run = pieces_of(head + "G1 X10" + filament + "\nG1 Y10" + filament + "\n")[1];
    for (const char* line : {"G90\n", "M83\n", "G1 X0 Y0 Z0.2 F6000\n"}) {
      static_cast<void>(printer.interpret({line, 0}));
    }
  }

  [[nodiscard]] std::optional<std::string> objection_to(const std::string& text,
                                                        double max_lines_per_s = 1000.0) const {
    const dynamics::NozzleXY nozzle = at_rest({0.0, 0.0, 0.2, 0.0}, rules().nozzle);
    return judge(run, run.moves, deviation_of(run, run.moves, run.moves, nozzle, rules(), 0.0),
                 text, printer, {}, nozzle, rules(), 0.0, {}, max_lines_per_s, {})
        .objection;
  }

  Piece run;
  gcode::Interpreter printer;
};

TEST(Judge, TakesTheOriginalItselfAsNoWorse) {
  EXPECT_EQ(Corner(true).objection_to("G1 X10 E0.5\nG1 Y10 E0.5\n"), std::nullopt);
  EXPECT_EQ(Corner(false).objection_to("G1 X10\nG1 Y10"), std::nullopt);
}

TEST(Judge, RejectsACutCornerWithTheFigures) {
  const std::optional<std::string> reason =
      Corner(true).objection_to("G1 X8 E0.4\nG1 X10 Y2 E0.2\nG1 Y10 E0.4\n");
  ASSERT_TRUE(reason.has_value());
  EXPECT_TRUE(
      reason->starts_with("compensation would be worse: with the swing that is left, contour RMS "))
      << *reason;
}

TEST(Judge, RejectsTheSamePathAtTheWrongTimeWhereNothingIsPrinted) {
  const std::optional<std::string> reason =
      Corner(false).objection_to("G1 X10 F600\nG1 Y10 F6000\n");
  ASSERT_TRUE(reason.has_value());
  EXPECT_TRUE(reason->starts_with("compensation would be worse: tracking RMS in travel "))
      << *reason;
}

// In the middle of a run the nozzle moves on with the path, and that motion is no swing. Here the
// part ends half a percent too fast, which is little beside the swing at its start.
TEST(Judge, TakesOnlyWhatIsOffThePlanAsSwingWhereAPartEnds) {
  Piece part = pieces_of("G90\nM83\nG1 X0 Y0 Z0.2 F6000\nG1 X10 E0.5\nG1 X20 E0.5\n")[1];
  part.after = {part.moves.back()};
  part.moves.pop_back();
  part.events.pop_back();
  part.move_counts.pop_back();
  ASSERT_GT(part.moves.back().end_v_mm_s, 99.0);
  gcode::Interpreter printer;
  for (const char* line : {"G90\n", "M83\n", "G1 X0 Y0 Z0.2 F6000\n"}) {
    static_cast<void>(printer.interpret({line, 0}));
  }
  const dynamics::NozzleXY still = at_rest({0.0, 0.0, 0.2, 0.0}, rules().nozzle);
  dynamics::NozzleXY swinging = still;
  swinging.y.add(rules().nozzle.y.riding(0.02));
  const Verdict verdict =
      judge(part, part.moves, deviation_of(part, part.moves, part.moves, swinging, rules(), 0.0),
            "G1 X10 E0.5 F6030\n", printer, {}, still, rules(), 0.0, {}, 1000.0,
            {.lines_before = {}, .goes_on = true});
  EXPECT_EQ(verdict.objection, std::nullopt);
}

TEST(Judge, RejectsMoreLinesPerSecondThanAllowed) {
  std::string text = "G1 F6000\n";
  for (int i = 1; i <= 40; ++i) {
    text += fmt::format("G1 X{:.2f}\n", 0.25 * i);
  }
  text += "G1 Y10\n";
  EXPECT_EQ(Corner(false).objection_to(text, 1000.0), std::nullopt);
  const std::optional<std::string> reason = Corner(false).objection_to(text, 100.0);
  ASSERT_TRUE(reason.has_value());
  EXPECT_TRUE(reason->ends_with(" lines per second are more than emit.max_lines_per_s, 100"))
      << *reason;
  // The two sliced lines exceed this limit as well, and no output could have fewer lines.
  EXPECT_EQ(Corner(false).objection_to("G1 X10\nG1 Y10\n", 1.0), std::nullopt);
}

TEST(Judge, ReplaysByTheLimitsInTheText) {
  // With such a low acceleration the base is far too late at the corner, and so is the nozzle.
  EXPECT_TRUE(
      Corner(false).objection_to("SET_VELOCITY_LIMIT ACCEL=100\nG1 X10\nG1 Y10\n").has_value());
}

// x of the nozzle after the base went from 0 to 10 mm by the plan of the moves. Uses quadrature
// with the oscillator's impulse response g: p(T) = ∫ g(T − t) (2ζω ḃ + ω² b) dt.
double nozzle_by_convolution(const std::vector<planner::PlannedMove>& moves) {
  const dynamics::FlexibleAxis axis = rules().nozzle.x;
  const double damped =
      axis.main().omega_rad_s * std::sqrt(1.0 - axis.main().zeta * axis.main().zeta);
  const auto impulse = [&](double t) {
    return std::exp(-axis.main().zeta * axis.main().omega_rad_s * t) * std::sin(damped * t) /
           damped;
  };
  double sum = 0.0;
  double end = 0.0;
  for (const planner::PlannedMove& move : moves) {
    end += move.duration_s();
  }
  const double start = 10.0;  // before, the nozzle rests at x = 10
  double origin = 0.0;
  constexpr int kSteps = 100000;
  for (const planner::PlannedMove& move : moves) {
    const double step = move.duration_s() / kSteps;
    for (double t = 0.5 * step; t < move.duration_s(); t += step) {
      const double b = move.position_mm(t)[gcode::X] - start;
      const double v = move.velocity_mm_s(t) * move.direction[gcode::X];
      sum += step * impulse(end - origin - t) *
             (2.0 * axis.main().zeta * axis.main().omega_rad_s * v +
              axis.main().omega_rad_s * axis.main().omega_rad_s * b);
    }
    origin += move.duration_s();
  }
  return start + sum;
}

// x of the nozzle after the last piece of the text.
dynamics::NozzleXY nozzle_after(const std::string& text) {
  NozzleFollower follower(rules().nozzle, rules().fixed, {});
  for (const Piece& piece : pieces_of(text)) {
    follower.follow(piece);
  }
  return follower.nozzle();
}

TEST(NozzleFollower, TheNozzleIsWhereTheConvolutionPutsIt) {
  const std::string text = "G90\nG1 X10 Y10 Z1 F6000\nM400\nG1 X12 Z5\nG1 X17.5 Z8\n";
  const std::vector<Piece> pieces = pieces_of(text);
  std::vector<planner::PlannedMove> moves(pieces.back().moves.end() - 2, pieces.back().moves.end());
  dynamics::NozzleXY nozzle = at_rest({10.0, 10.0, 1.0, 0.0}, rules().nozzle);
  Piece last = pieces.back();
  last.events.erase(last.events.begin(), last.events.end() - 2);
  last.move_counts.assign(2, 1);
  last.moves = moves;
  NozzleFollower follower(rules().nozzle, rules().fixed, {});
  follower.set(nozzle, {10.0, 10.0, 1.0, 0.0});
  follower.follow(last);
  nozzle = follower.nozzle();
  EXPECT_NEAR(nozzle.x.position(), nozzle_by_convolution(moves), 1e-6);
  EXPECT_GT(std::abs(nozzle.x.position() - 17.5), 1e-3) << "the case shows nothing";
  EXPECT_NEAR(nozzle.y.position(), 10.0, 1e-12);
}

TEST(NozzleFollower, APauseLetsTheNozzleRingOn) {
  const std::string moved = "G90\nG1 X10 Y10 Z1 F6000\nM400\nG1 X17.5 Z8\n";
  const dynamics::NozzleXY before = nozzle_after(moved);
  const dynamics::NozzleXY after = nozzle_after(moved + "G4 P7\n");
  const dynamics::NozzleState expected =
      dynamics::exact_step(rules().nozzle.x, before.x, {17.5, 0.0, 0.0}, 7e-3);
  EXPECT_NEAR(after.x.position(), expected.position(), 1e-9);
  EXPECT_NEAR(after.x.velocity(), expected.velocity(), 1e-6);
  EXPECT_NE(after.x.velocity(), before.x.velocity());
}

TEST(NozzleFollower, APauseRightAfterARunDoesSo) {
  const std::string moved = "G90\nG1 X10 Y10 Z1 F6000\nG1 X17.5 Y12\n";
  const dynamics::NozzleXY before = nozzle_after(moved);
  const dynamics::NozzleXY after = nozzle_after(moved + "G4 P7\n");
  const dynamics::NozzleState expected =
      dynamics::exact_step(rules().nozzle.x, before.x, {17.5, 0.0, 0.0}, 7e-3);
  EXPECT_NEAR(after.x.position(), expected.position(), 1e-9);
  EXPECT_NE(after.x.velocity(), before.x.velocity());
}

TEST(NozzleFollower, HomingLetsTheNozzleComeToRest) {
  const dynamics::NozzleXY after = nozzle_after("G90\nG1 X10 Y10 Z1 F6000\nG1 X17.5 Z8\nG28\n");
  EXPECT_EQ(after.x.velocity(), 0.0);
  EXPECT_EQ(after.y.velocity(), 0.0);
}

// An exactly tuned shaper leaves no swing.
TEST(NozzleFollower, AnExactShaperLeavesTheRunAfterItAtRest) {
  const std::string text =
      "G90\nM83\nG1 X10 Y10 Z1 F6000\nM400\nG1 X17.5 Y12 Z1.5\nM400\nG1 X20 E1\nG1 Y15 E1\n";
  verify::Rules exact = rules();
  exact.fixed.shaper = {"zv", "zv", exact.nozzle.x.main().zeta, exact.nozzle.y.main().zeta};
  gcode::Shaper shaper;
  shaper.freq_hz.x = 45.0;
  shaper.freq_hz.y = 30.0;
  std::vector<Piece> pieces = pieces_of(text);
  const Piece run = pieces.back();
  pieces.pop_back();
  const auto before_run = [&](const gcode::Shaper& printers) {
    NozzleFollower follower(exact.nozzle, exact.fixed, printers);
    for (const Piece& piece : pieces) {
      EXPECT_EQ(follower.follow(piece), 0.0) << "nothing switches it";
    }
    const double stop_s = follower.begin_run(run);
    EXPECT_EQ(stop_s, planner::switching_s(exact.fixed, {printers}, {}));
    EXPECT_EQ(follower.begin_run(run), 0.0) << "it is off";
    return follower.nozzle();
  };
  const dynamics::NozzleXY shaped = before_run(shaper);
  EXPECT_NEAR(shaped.x.position(), 17.5, 1e-9);
  EXPECT_NEAR(shaped.x.velocity(), 0.0, 1e-6);
  EXPECT_NEAR(shaped.y.position(), 12.0, 1e-9);
  EXPECT_NEAR(shaped.y.velocity(), 0.0, 1e-6);
  EXPECT_GT(std::abs(before_run({}).x.velocity()), 0.1) << "the case shows nothing";
}

// Before a line that may move the machine by itself, the shaper is switched on again, and the wipe
// after it is shaped. Before other lines the shaper stays off.
TEST(NozzleFollower, TheShaperComesBackBeforeWhatMovesByItself) {
  gcode::Shaper shaper;
  shaper.freq_hz.x = shaper.freq_hz.y = 40.0;
  const std::string text = "G90\nM83\nG1 X10 Y10 Z1 F6000\nG1 X20 E1\nM117 a\nM400\nG28\n";
  NozzleFollower follower(rules().nozzle, rules().fixed, shaper);
  double stops_s = 0.0;
  for (const Piece& piece : pieces_of(text)) {
    stops_s += piece.is_run ? follower.begin_run(piece) : follower.follow(piece);
  }
  const double once_s = planner::switching_s(rules().fixed, {shaper}, {});
  EXPECT_GT(once_s, 0.0);
  EXPECT_DOUBLE_EQ(stops_s, once_s + planner::switching_s(rules().fixed, {}, {shaper}));
}

}  // namespace
}  // namespace unflex::run
