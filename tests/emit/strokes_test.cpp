#include "strokes.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "drawn_path.hpp"
#include "line_ends.hpp"
#include "plain_base.hpp"
#include "vertices.hpp"

namespace unflex::emit {
namespace {

using gcode::E;
using gcode::X;
using gcode::Y;
using gcode::Z;
using testing::kPeriod_s;
using testing::options;
using testing::Path;
using testing::random_path;

// Rises from 0 to 1 with the first two derivatives zero at both ends.
double smooth(double s) {
  s = std::clamp(s, 0.0, 1.0);
  return s * s * s * (10.0 + s * (-15.0 + 6.0 * s));
}

TEST(Strokes, EndExactlyWhereAndWithWhatTheMovesEnd) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const Path path = random_path(seed, 30);
    const std::vector<Stroke> drawn = path.draw(testing::plan_as_base(path.moves));
    ASSERT_FALSE(drawn.empty());
    const gcode::Position& end = path.moves.back().segment.end_mm;
    EXPECT_EQ(drawn.back().place_mm.x, end[X]);
    EXPECT_EQ(drawn.back().place_mm.y, end[Y]);
    EXPECT_EQ(drawn.back().z_mm, end[Z]);
    EXPECT_EQ(drawn.back().e_mm, end[E] - path.moves.front().segment.start_mm[E]);
    EXPECT_LE(drawn.back().events, path.events.size());
  }
}

// Marlin may owe filament of earlier moves. It lays or draws back that filament with the first line
// of the run.
TEST(Strokes, LayWhatTheFileHasThoughTheFirmwareIsBehindIt) {
  constexpr double kFirst_mm = 0.5;
  constexpr double kAlong_mm = 0.015;  // filament follows the nozzle, which swings by 0.15 mm
  for (const double first_mm : {kFirst_mm, 0.0, -kFirst_mm}) {
    for (const double behind_mm : {0.05, -0.05}) {
      Path path({{100.0, 100.0, 0.2, 3.0},
                 {110.0, 100.0, 0.2, 3.0 + first_mm},
                 {110.0, 110.0, 0.2, 4.0 + first_mm}});
      for (std::size_t i = 0; i < path.moves.size(); ++i) {
        path.events[i].segments = {path.moves[i].segment};
      }
      path.moves.front().segment.start_mm[E] -= behind_mm;
      for (const Stroke& stroke : path.draw(testing::plan_as_base(path.moves))) {
        const double share = (stroke.place_mm.x - 100.0) / 10.0;
        // The lines pass the corner at a small distance.
        if (share < 1.0 && stroke.place_mm.y < 100.01) {
          EXPECT_NEAR(stroke.e_mm, share * first_mm, std::abs(behind_mm) + kAlong_mm);
          EXPECT_GE(stroke.e_mm, std::min(0.0, first_mm));
          EXPECT_LE(stroke.e_mm, std::max(0.0, first_mm));
        } else {
          EXPECT_NEAR(stroke.e_mm, first_mm + (stroke.place_mm.y - 100.0) / 10.0, kAlong_mm);
        }
      }
    }
  }
}

// A line that returns to its start.
TEST(GiveLength, GoesAlongTheAxisThatTurnsAndStaysWithinItsTravel) {
  const Grid grid{{{0.0, 1e-4}, {0.0, 2e-4}}, {0.0, 1e-4}};
  LineRules rules;
  rules.reach.x = {0.0, 250.0};
  rules.reach.y = {-1.0, 210.0};
  const auto end_of = [&](double x_mm, double y_mm, double next_x_mm, double next_y_mm) {
    Stroke stroke{0.0, x_mm, y_mm};
    give_length({1.0, next_x_mm, next_y_mm}, grid, rules, stroke);
    return std::array{stroke.place_mm.x, stroke.place_mm.y};
  };
  const auto expect_end = [](std::array<double, 2> end_mm, double x_mm, double y_mm) {
    EXPECT_NEAR(end_mm[0], x_mm, 1e-9);
    EXPECT_NEAR(end_mm[1], y_mm, 1e-9);
  };
  expect_end(end_of(100.0, 100.0, 101.0, 100.5), 100.0001, 100.0);
  expect_end(end_of(100.0, 100.0, 99.0, 100.5), 99.9999, 100.0);
  expect_end(end_of(100.0, 100.0, 100.5, 99.0), 100.0, 99.9998);
  expect_end(end_of(250.0, 210.0, 250.0, 209.0), 250.0, 209.9998);
  // At both ends of the travel.
  expect_end(end_of(250.0, 100.0, 250.0, 100.0), 249.9999, 100.0);
  expect_end(end_of(0.0, 100.0, -1e-5, 100.0), 0.0001, 100.0);
  expect_end(end_of(100.0, 210.0, 100.0, 210.00001), 100.0, 209.9998);
  expect_end(end_of(100.0, -1.0, 100.0, -1.00001), 100.0, -0.9998);
}

// The largest number of strokes that begin within any 100 ms.
std::size_t most_at_once(const std::vector<Stroke>& drawn) {
  std::size_t most = 0;
  for (std::size_t first = 0; first < drawn.size(); ++first) {
    const auto begin_s = [&](std::size_t i) { return i > 0 ? drawn[i - 1].end_s : 0.0; };
    std::size_t after = first;
    while (after < drawn.size() && begin_s(after) < begin_s(first) + 0.1) {
      ++after;
    }
    most = std::max(most, after - first);
  }
  return most;
}

TEST(Strokes, AreNoMoreThanTheirShareOfTheBudget) {
  EmitOptions how = options();
  how.fixed.firmware = Firmware::marlin;
  how.lines.burst_lines = 20;
  how.lines.min_line_s = 2e-3;
  how.lines.min_steps = 6;
  Grid grid;
  grid.x = grid.y = {0.0, 0.0125};
  const Path path = random_path(7, 40);
  const dynamics::BaseTrajectory base = testing::plan_as_base(path.moves);
  emit::Run run{&path.events, &path.move_counts, &path.moves, &base};
  for (const double share : {1.0, 0.85, 0.5}) {
    run.limits_share = share;
    const std::size_t most = most_at_once(strokes(run, grid, how));
    EXPECT_LE(static_cast<double>(most), 20.0 * share);
    EXPECT_GT(static_cast<double>(most), 10.0 * share);
  }
}

TEST(Strokes, LieOnTheGridAndTakeNoLessThanTheShortestTime) {
  for (const double shortest : {1e-3, 2e-3, 5e-3}) {
    EmitOptions how = options();
    how.lines.min_line_s = shortest;
    const Path path = random_path(7, 40);
    double last = 0.0;
    for (const Stroke& stroke : path.draw(testing::plan_as_base(path.moves), how)) {
      EXPECT_GE(stroke.end_s - last, shortest - 1e-9);
      EXPECT_LE(stroke.end_s - last, how.lines.max_line_s + 2.0 * shortest);
      EXPECT_NEAR(stroke.place_mm.x * 1e4, std::round(stroke.place_mm.x * 1e4), 1e-5);
      EXPECT_NEAR(stroke.place_mm.y * 1e4, std::round(stroke.place_mm.y * 1e4), 1e-5);
      last = stroke.end_s;
    }
  }
}

TEST(Strokes, LieOnAGridThatBeginsAtTheZeroOfTheFile) {
  const Path path = random_path(3, 10);
  const dynamics::BaseTrajectory base = testing::plan_as_base(path.moves);
  const emit::Run run{&path.events, &path.move_counts, &path.moves, &base, 0.0};
  const std::vector<Stroke> drawn =
      strokes(run, {{0.00003, 1e-4}, {-1.00007, 1e-4}, {}}, options());
  for (std::size_t i = 0; i + 1 < drawn.size(); ++i) {
    const double steps = (drawn[i].place_mm.x - 0.00003) * 1e4;
    EXPECT_NEAR(steps, std::round(steps), 1e-5);
  }
}

// Position on a polyline of strokes at time t.
std::array<double, 2> at(const std::vector<Stroke>& drawn, const gcode::Position& start, double t) {
  Stroke from{0.0, start[X], start[Y]};
  for (const Stroke& to : drawn) {
    if (t <= to.end_s) {
      const double s = (t - from.end_s) / (to.end_s - from.end_s);
      return {from.place_mm.x + s * (to.place_mm.x - from.place_mm.x),
              from.place_mm.y + s * (to.place_mm.y - from.place_mm.y)};
    }
    from = to;
  }
  return {from.place_mm.x, from.place_mm.y};
}

// A full turn of radius 5 mm in 0.5 s, from rest to rest, for a move along its chord.
class Turn : public ::testing::Test {
 protected:
  static constexpr double kRadius_mm = 5.0;
  static constexpr double kDuration_s = 0.5;

  static std::array<double, 2> circle(double t) {
    const double angle = 2.0 * std::numbers::pi * smooth(t / kDuration_s);
    return {100.0 + kRadius_mm * std::sin(angle), 100.0 - kRadius_mm * std::cos(angle)};
  }

  // The path goes there and back, so that it ends at its start; its plan does not matter here.
  Turn()
      : path_({{100.0, 95.0, 0.2, 0.0}, {110.0, 95.0, 0.2, 1.0}, {100.0, 95.0, 0.2, 2.0}}, 50.0) {}

  // The largest distance between the nozzle on these strokes and the nozzle on the circle; the RMS
  // distance if `rms`.
  [[nodiscard]] double nozzle_error_mm(const std::vector<Stroke>& drawn,
                                       const dynamics::FlexibleAxis& axis, bool rms = false) const {
    constexpr double kStep_s = 2e-5;
    const gcode::Position& start = path_.moves.front().segment.start_mm;
    std::array<dynamics::NozzleState, 2> on_strokes = {{{start[X], 0.0}, {start[Y], 0.0}}};
    std::array<dynamics::NozzleState, 2> on_circle = on_strokes;
    double worst = 0.0;
    double square = 0.0;
    int steps = 0;
    for (double t = 0.0; t + kStep_s <= kDuration_s; t += kStep_s, ++steps) {
      const auto advance = [&](auto&& path, auto& states) {
        const auto a = path(t);
        const auto b = path(t + kStep_s);
        for (std::size_t i = 0; i < 2; ++i) {
          states[i] =
              dynamics::exact_step(axis, states[i], {a[i], (b[i] - a[i]) / kStep_s, 0.0}, kStep_s);
        }
      };
      advance([&](double s) { return at(drawn, start, s); }, on_strokes);
      advance([&](double s) { return circle(s); }, on_circle);
      const double error = std::hypot(on_strokes[0].position() - on_circle[0].position(),
                                      on_strokes[1].position() - on_circle[1].position());
      worst = std::max(worst, error);
      square += error * error;
    }
    return rms ? std::sqrt(square / steps) : worst;
  }

  Path path_;
  dynamics::BaseTrajectory base_ = testing::sampled(circle, kDuration_s);
};

TEST_F(Turn, MovesTheNozzleByNoMoreThanTheTolerance) {
  std::size_t last_lines = 1000000;
  for (const double tolerance_mm : {0.1e-3, 0.3e-3, 1e-3, 4e-3}) {
    EmitOptions how = options();
    how.lines.tolerance_mm = tolerance_mm;
    how.lines.max_speed_step_mm_s = 1e6;
    const std::vector<Stroke> drawn = path_.draw(base_, how);
    const double worst = nozzle_error_mm(drawn, how.lines.nozzle.x);
    // Each line alone is within the tolerance, but its neighbours add to the error.
    EXPECT_LE(worst, 3.0 * tolerance_mm + 0.5e-4);
    EXPECT_GE(worst, 0.3 * tolerance_mm) << "lines could be longer";
    EXPECT_LT(drawn.size(), last_lines);
    last_lines = drawn.size();
  }
}

TEST_F(Turn, MakesUpForACoarseGrid) {
  constexpr double kCoarse_mm = 20e-3;
  EmitOptions how = options();
  how.lines.min_line_s = 5e-3;
  how.lines.tolerance_mm = 0.1e-3;
  std::vector<double> times = {0.0};
  append_line_ends(base_, 0.0, kDuration_s, how.lines, times);
  const auto rms_mm = [&](double step_mm, double then_rounded_to_mm) {
    const auto place = [&](std::size_t axis) {
      std::vector<double> at = VertexChooser(base_, axis, how.lines.nozzle.x)
                                   .choose(times, {0.0, step_mm}, {}, {})
                                   .position_mm;
      for (std::size_t i = 1; i + 1 < at.size(); ++i) {
        EXPECT_NEAR(at[i] / step_mm, std::round(at[i] / step_mm), 1e-6);
        at[i] = std::round(at[i] / then_rounded_to_mm) * then_rounded_to_mm;
      }
      return at;
    };
    const auto x = place(0);
    const auto y = place(1);
    std::vector<Stroke> drawn;
    for (std::size_t i = 1; i < times.size(); ++i) {
      drawn.push_back({times[i], x[i], y[i]});
    }
    return nozzle_error_mm(drawn, how.lines.nozzle.x, true);
  };
  EXPECT_LT(rms_mm(1e-4, 1e-4), 1e-3);
  EXPECT_LT(rms_mm(kCoarse_mm, kCoarse_mm), 0.7 * rms_mm(1e-4, kCoarse_mm));
}

TEST_F(Turn, ChangesSpeedInSmallSteps) {
  const auto largest_step = [&](double allowed) {
    EmitOptions how = options();
    how.lines.tolerance_mm = 10e-3;
    how.lines.max_speed_step_mm_s = allowed;
    Stroke from{0.0, 100.0, 95.0};
    double last_v = 0.0;
    double largest = 0.0;
    for (const Stroke& to : path_.draw(base_, how)) {
      const double v = (to.place_mm.x - from.place_mm.x) / (to.end_s - from.end_s);
      largest = std::max(largest, std::abs(v - last_v));
      last_v = v;
      from = to;
    }
    return largest;
  };
  EXPECT_GT(largest_step(1e6), 25.0);
  // Vertices lie a little off the curve.
  EXPECT_LT(largest_step(10.0), 15.0);
}

// On CoreXY the motors do x + y and x − y, so steps of both axes add up.
TEST_F(Turn, ChangesTheSpeedOfSharedMotorsInSmallSteps) {
  const auto largest_step = [&](double allowed) {
    EmitOptions how = options();
    how.lines.tolerance_mm = 10e-3;
    how.lines.max_speed_step_mm_s = allowed;
    how.lines.motors = Motors(Kinematics::corexy, Firmware::klipper);
    Stroke from{0.0, 100.0, 95.0};
    std::array<double, 2> last{};
    double largest = 0.0;
    for (const Stroke& to : path_.draw(base_, how)) {
      const double duration_s = to.end_s - from.end_s;
      const std::array<double, 2> v = {(to.place_mm.x - from.place_mm.x) / duration_s,
                                       (to.place_mm.y - from.place_mm.y) / duration_s};
      if (from.end_s > 0.0) {
        largest = std::max(largest, std::abs(v[0] - last[0]) + std::abs(v[1] - last[1]));
      }
      last = v;
      from = to;
    }
    return largest;
  };
  EXPECT_GT(largest_step(1e6), 25.0);
  EXPECT_LT(largest_step(20.0), 20.5);
}

TEST_F(Turn, IsAsWideAsTheBaseOnAverage) {
  const std::vector<Stroke> drawn = path_.draw(base_);
  double mean = 0.0;
  double inscribed = 0.0;
  int samples = 0;
  double start = 0.1;
  for (double t = 0.1; t < kDuration_s - 0.1; t += 1e-5, ++samples) {
    const auto p = at(drawn, path_.moves.front().segment.start_mm, t);
    mean += std::hypot(p[0] - 100.0, p[1] - 100.0) - kRadius_mm;
    start = t;
  }
  mean /= samples;
  for (std::size_t i = 1; i < drawn.size(); ++i) {
    if (drawn[i - 1].end_s > 0.1 && drawn[i].end_s < start) {
      const auto a = circle(drawn[i - 1].end_s);
      const auto b = circle(drawn[i].end_s);
      const double sagitta =
          kRadius_mm - std::hypot(0.5 * (a[0] + b[0]) - 100.0, 0.5 * (a[1] + b[1]) - 100.0);
      inscribed += 2.0 / 3.0 * sagitta * (drawn[i].end_s - drawn[i - 1].end_s);
    }
  }
  inscribed /= kDuration_s - 0.2;
  EXPECT_GT(inscribed, 0.5e-3) << "the case shows nothing";
  // At the four outermost points the vertices stay within the base's extent.
  EXPECT_LT(std::abs(mean), 0.1 * inscribed);
}

// If the base itself exceeds the limit, its lines may use as much acceleration as the base needs,
// but no more.
TEST_F(Turn, DrivesTheLinesNoHarderThanTheBaseWhereThatIsAboveTheLimit) {
  EmitOptions how = options();
  how.lines.max_accel_mm_s2 = 1.0;
  double largest = 0.0;
  for (std::size_t k = 1; k < base_.nodes(); ++k) {
    largest = std::max(largest, std::abs(base_.x.velocity_mm_s[k] - base_.x.velocity_mm_s[k - 1]) /
                                    base_.period_s);
  }
  const std::vector<Stroke> drawn = path_.draw(base_, how);
  for (std::size_t i = 2; i < drawn.size(); ++i) {
    const double before_s = drawn[i - 1].end_s - drawn[i - 2].end_s;
    const double after_s = drawn[i].end_s - drawn[i - 1].end_s;
    const double change = (drawn[i].place_mm.x - drawn[i - 1].place_mm.x) / after_s -
                          (drawn[i - 1].place_mm.x - drawn[i - 2].place_mm.x) / before_s;
    const double rounding = 4e-4 / std::min(before_s, after_s);
    EXPECT_LE(std::abs(change), 1.02 * largest * 0.5 * (before_s + after_s) + rounding);
  }
}

TEST_F(Turn, GoesNoFurtherOutThanTheBase) {
  // The base may touch the end of its travel at the outermost points.
  EmitOptions how = options();
  how.lines.reach.x = how.lines.reach.y = {98.0, 102.0};
  for (const Stroke& stroke : path_.draw(base_, how)) {
    EXPECT_LE(std::abs(stroke.place_mm.x - 100.0), kRadius_mm + 0.51e-4);
    EXPECT_LE(std::abs(stroke.place_mm.y - 100.0), kRadius_mm + 0.51e-4);
  }
}

TEST(Strokes, KeepTheAccelerationFromLineToLine) {
  // The base swings as hard as allowed: b̈ = A sin(ωt).
  constexpr double kAccel = 20000.0;
  constexpr double kOmega = 2.0 * std::numbers::pi * 80.0;
  const Path path({{0.0, 0.0, 0.2, 0.0}, {1.0, 0.0, 0.2, 0.0}, {0.0, 0.0, 0.2, 0.0}});
  const auto swing = [](double t) {
    return std::array<double, 2>{kAccel / (kOmega * kOmega) * (1.0 - std::cos(kOmega * t)), 0.0};
  };
  EmitOptions how = options();
  how.lines.max_accel_mm_s2 = kAccel;
  const std::vector<Stroke> drawn = path.draw(testing::sampled(swing, 0.25), how);
  double last_v = 0.0;
  double last_t = 0.0;
  Stroke from{0.0, 0.0, 0.0};
  for (const Stroke& to : drawn) {
    const double t = to.end_s - from.end_s;
    const double v = (to.place_mm.x - from.place_mm.x) / t;
    if (last_t > 0.0) {
      // Rounding to the grid adds up to 2·10⁻⁴ mm over the square of the shorter time.
      EXPECT_LE(std::abs(v - last_v) / (0.5 * (t + last_t)),
                kAccel + 2e-4 / std::pow(std::min(t, last_t), 2));
    }
    last_v = v;
    last_t = t;
    from = to;
  }
}

TEST(Strokes, MergeWhatWouldHaveNoLength) {
  const Path path({{0.0, 0.0, 0.2, 0.0}, {10.0, 0.0, 0.2, 1.0}});
  // The base rests, moves, rests, moves and rests. Each rest is longer than any line.
  const auto halting = [](double t) {
    return std::array<double, 2>{5.0 * smooth((t - 0.13) / 0.05) + 5.0 * smooth((t - 0.35) / 0.05),
                                 0.0};
  };
  const std::vector<Stroke> drawn = path.draw(testing::sampled(halting, 0.55));
  Stroke from{0.0, 0.0, 0.0};
  for (const Stroke& to : drawn) {
    EXPECT_GE(std::abs(to.place_mm.x - from.place_mm.x), 0.5e-4);
    EXPECT_GT(to.speed_mm_s, 0.0);
    from = to;
  }
  // The rests before and after the motion are dropped, so the clock lacks them; the rest between
  // the motions stays. Each end may lie within a line of up to 50 ms.
  EXPECT_GE(drawn.back().end_s, 0.27);
  EXPECT_LE(drawn.back().end_s, 0.27 + 0.1);
  EXPECT_EQ(drawn.back().e_mm, 1.0);
  EXPECT_EQ(drawn.back().place_mm.x, 10.0);
}

TEST(Strokes, AreNoneWhereNothingMoves) {
  const Path path({{0.0, 0.0, 0.2, 0.0}, {0.00004, 0.0, 0.2, 0.0}});
  EXPECT_TRUE(path.draw(testing::plan_as_base(path.moves)).empty());
}

TEST(Strokes, EndWhereALineStandsOrFilamentPerMillimetreChanges) {
  Path path({{0.0, 0.0, 0.2, 0.0},
             {20.0, 0.0, 0.2, 1.0},
             {40.0, 0.0, 0.2, 2.0},
             {60.0, 0.0, 0.2, 4.0},
             {80.0, 0.0, 0.2, 6.0}});
  path.insert(1, gcode::EventKind::passive);
  const std::vector<Stroke> drawn = path.draw(testing::plan_as_base(path.moves));
  const double first = path.moves[0].duration_s();
  const double second = first + path.moves[1].duration_s();
  const auto ends_at = [&](double t) {
    return std::ranges::any_of(drawn,
                               [&](const Stroke& s) { return std::abs(s.end_s - t) < 1e-9; });
  };
  EXPECT_TRUE(ends_at(first));
  EXPECT_TRUE(ends_at(second));
  EXPECT_FALSE(ends_at(second + path.moves[2].duration_s()));
  // The passive line comes after the strokes that end before its time, and before all others.
  for (std::size_t i = 0; i < drawn.size(); ++i) {
    EXPECT_EQ(drawn[i].events >= 2, i > 0 && drawn[i - 1].end_s > first - 0.6e-3) << i;
  }
}

TEST(Strokes, LayFilamentMoveByMove) {
  // This nozzle stays with the base, so it passes from move to move when the plan does. The limit
  // is raised because Klipper would otherwise require jumps of the flow to be levelled.
  EmitOptions how = options();
  how.lines.nozzle.x = how.lines.nozzle.y = dynamics::from_frequency(2000.0, 0.5);
  how.fixed.instantaneous_corner_velocity_mm_s = 1e6;
  constexpr double kFilament_mm = 5e-4;  // a tenth of what a line lays
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const Path path = random_path(seed, 60);
    const std::vector<Stroke> drawn = path.draw(testing::plan_as_base(path.moves), how);
    double t = 0.0;
    std::size_t i = 0;
    for (const planner::PlannedMove& move : path.moves) {
      t += move.duration_s();
      const double laid = move.segment.end_mm[E] - path.moves.front().segment.start_mm[E];
      // The line that spans the end of the move, or ends there.
      while (i + 1 < drawn.size() && drawn[i].end_s < t - 1e-9) {
        ++i;
      }
      EXPECT_LE(i > 0 ? drawn[i - 1].e_mm : 0.0, laid + kFilament_mm);
      EXPECT_GE(drawn[i].e_mm, laid - kFilament_mm);
    }
  }
}

// A base that is meant for several frequencies may bring the nozzle to rest only after the moves
// have ended. The filament of these last micrometres must be laid before: a tail lays nothing.
TEST(Strokes, HaveLaidAllFilamentWhenTheMovesHaveEnded) {
  constexpr double kLate_s = 10e-3;
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const Path path = random_path(seed, 30);
    const double end_s = planner::duration_s(path.moves);
    const double all_mm =
        path.moves.back().segment.end_mm[E] - path.moves.front().segment.start_mm[E];
    std::size_t in_tail = 0;
    for (const Stroke& stroke : path.draw(testing::plan_as_base(path.moves, kLate_s))) {
      if (stroke.end_s > end_s - 1e-9) {
        EXPECT_NEAR(stroke.e_mm, all_mm, 1e-12) << seed;
        ++in_tail;
      }
    }
    EXPECT_GT(in_tail, 2U) << seed;
  }
}

}  // namespace
}  // namespace unflex::emit
