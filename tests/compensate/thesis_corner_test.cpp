// The source thesis' corner, (0,0) → (10,0) → (10,10) with a full stop at the corner, compensated.
// docs/theory.md has the table.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <ostream>
#include <string>
#include <vector>

#include "playback.hpp"

namespace unflex::compensate {
namespace {

// The limits on the remaining error are a tenth above the measured values.
struct CornerCase {
  std::string name;
  double omega = 100.0;
  double zeta = 0.5;
  double accel = 5000.0;
  double velocity = 100.0;
  double uncompensated_max_um = 0.0;
  double max_rms_um = 0.0;
  double max_um = 0.0;
};

void PrintTo(const CornerCase& c, std::ostream* out) { *out << c.name; }

struct Contour {
  double max_um = 0.0;
  double rms_um = 0.0;
};

double distance_mm(const planner::PlannedMove& move, double x, double y) {
  const gcode::Position& a = move.segment.start_mm;
  const gcode::Position& b = move.segment.end_mm;
  const double dx = b[gcode::X] - a[gcode::X];
  const double dy = b[gcode::Y] - a[gcode::Y];
  const double along = ((x - a[gcode::X]) * dx + (y - a[gcode::Y]) * dy) / (dx * dx + dy * dy);
  const double u = std::clamp(along, 0.0, 1.0);
  return std::hypot(a[gcode::X] + u * dx - x, a[gcode::Y] + u * dy - y);
}

// Distance of the nozzle from the corner's two edges while the plan moves.
Contour contour(const std::vector<planner::PlannedMove>& moves,
                const std::vector<dynamics::NozzleState>& x,
                const std::vector<dynamics::NozzleState>& y, double step_s) {
  const double end = planner::duration_s(moves);
  double worst = 0.0;
  double sum = 0.0;
  std::size_t count = 0;
  for (; count < x.size() && static_cast<double>(count) * step_s <= end; ++count) {
    const double error = std::min(distance_mm(moves[0], x[count].position(), y[count].position()),
                                  distance_mm(moves[1], x[count].position(), y[count].position()));
    worst = std::max(worst, error);
    sum += error * error;
  }
  return {1e3 * worst, 1e3 * std::sqrt(sum / static_cast<double>(count))};
}

// The nozzle while the base follows the plan itself, in chords of `step_s`.
std::vector<dynamics::NozzleState> play_plan(const dynamics::FlexibleAxis& axis,
                                             const std::vector<planner::PlannedMove>& moves,
                                             gcode::Axis which, double step_s) {
  std::vector<dynamics::NozzleState> result = {{}};
  double base = 0.0;
  for (double t = step_s; t <= planner::duration_s(moves); t += step_s) {
    const double next = testing::plan_at(moves, t)[which];
    result.push_back(
        dynamics::exact_step(axis, result.back(), {base, (next - base) / step_s, 0.0}, step_s));
    base = next;
  }
  return result;
}

class ThesisCorner : public ::testing::TestWithParam<CornerCase> {};

TEST_P(ThesisCorner, IsDrawnSharp) {
  const CornerCase& c = GetParam();
  const auto moves = testing::plan({{0.0, 0.0}, {10.0, 0.0}, {10.0, 10.0}},
                                   testing::planner_limits(c.velocity, c.accel, 0.0));
  const dynamics::FlexibleAxis axis{c.omega, c.zeta};
  compensate::Setup setup = testing::setup_for(axis, 4.0 * c.accel);
  const std::size_t nodes = node_grid(moves, setup).count;
  const RunWindow run = windows(moves, cut(nodes, setup), testing::at_rest(moves), setup).front();
  const auto engine = make_ipopt_engine();
  const auto x = engine->solve(run.x);
  const auto y = engine->solve(run.y);
  ASSERT_TRUE(x.has_value() && y.has_value());
  const double step = setup.period_s / testing::kSubsteps;
  const Contour before = contour(moves, play_plan(axis, moves, gcode::X, step),
                                 play_plan(axis, moves, gcode::Y, step), step);
  const Contour after = contour(moves, testing::play(axis, x->base, setup.period_s, {}),
                                testing::play(axis, y->base, setup.period_s, {}), step);
  EXPECT_NEAR(before.max_um, c.uncompensated_max_um, 0.01 * c.uncompensated_max_um);
  EXPECT_LE(after.rms_um, c.max_rms_um);
  EXPECT_LE(after.max_um, c.max_um);
}

INSTANTIATE_TEST_SUITE_P(
    Cases, ThesisCorner,
    ::testing::Values(CornerCase{"reference", 100.0, 0.5, 5000.0, 100.0, 464.0, 0.05, 0.46},
                      CornerCase{"softer", 50.0, 0.5, 5000.0, 100.0, 1130.0, 0.15, 1.4},
                      CornerCase{"stiffer", 200.0, 0.5, 5000.0, 100.0, 144.0, 0.035, 0.36},
                      CornerCase{"undamped", 100.0, 0.0, 5000.0, 100.0, 1881.0, 0.61, 14},
                      CornerCase{"critical", 100.0, 1.0, 5000.0, 100.0, 316.0, 0.027, 0.3},
                      CornerCase{"gentler", 100.0, 0.5, 1000.0, 100.0, 100.0, 0.0068, 0.092},
                      CornerCase{"harder", 100.0, 0.5, 10000.0, 100.0, 525.0, 0.091, 0.91},
                      CornerCase{"slower", 100.0, 0.5, 5000.0, 50.0, 262.0, 0.033, 0.46},
                      CornerCase{"faster", 100.0, 0.5, 5000.0, 200.0, 623.0, 0.05, 0.46}),
    [](const auto& tested) { return tested.param.name; });

}  // namespace
}  // namespace unflex::compensate
