// Plans of short paths, windows made of them, and the nozzle's response to a base trajectory.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "unflex/compensate/axis_window.hpp"
#include "unflex/compensate/run.hpp"
#include "unflex/dynamics/base_trajectory.hpp"
#include "unflex/dynamics/flexible_axis.hpp"
#include "unflex/planner/klipper_planner.hpp"

namespace unflex::compensate::testing {

struct Point {
  double x_mm;
  double y_mm;
  bool extrude = true;
};

// The plan from rest at the first point to rest at the last.
inline std::vector<planner::PlannedMove> plan(const std::vector<Point>& points,
                                              const planner::Limits& limits,
                                              double filament_mm = 0.3) {
  planner::KlipperPlanner planner(limits, {});
  gcode::Segment segment;
  segment.feed_mm_s = limits.max_velocity_mm_s;
  segment.end_mm = {points.front().x_mm, points.front().y_mm, 0.0, 0.0};
  for (std::size_t i = 1; i < points.size(); ++i) {
    segment.start_mm = segment.end_mm;
    segment.end_mm[gcode::X] = points[i].x_mm;
    segment.end_mm[gcode::Y] = points[i].y_mm;
    segment.end_mm[gcode::E] += points[i].extrude ? filament_mm : 0.0;
    planner.add(segment);
  }
  planner.stop();
  std::vector<planner::PlannedMove> moves;
  planner.take(moves);
  return moves;
}

inline planner::Limits planner_limits(double velocity, double accel, double corner_velocity) {
  return {velocity, accel, corner_velocity, 0.0};
}

// The plan's position t seconds after its start; it rests before and after.
inline gcode::Position plan_at(const std::vector<planner::PlannedMove>& moves, double t) {
  for (const planner::PlannedMove& move : moves) {
    if (t <= move.duration_s()) {
      return move.position_mm(t);
    }
    t -= move.duration_s();
  }
  return moves.back().segment.end_mm;
}

inline Setup setup_for(const dynamics::FlexibleAxis& axis, double base_accel) {
  Setup setup;
  setup.x.axis = setup.y.axis = axis;
  setup.x.limits.max_accel_mm_s2 = setup.y.limits.max_accel_mm_s2 = base_accel;
  setup.tail_s = std::max(8.0 * axis.main().zeta / axis.main().omega_rad_s, 2e-3);
  return setup;
}

inline dynamics::NozzleXY at_rest(const std::vector<planner::PlannedMove>& moves) {
  const gcode::Position& start = moves.front().segment.start_mm;
  return {{start[gcode::X], 0.0}, {start[gcode::Y], 0.0}};
}

// The x axis of the run as one window, starting and ending at rest.
inline AxisWindow x_window(const std::vector<planner::PlannedMove>& moves, const Setup& setup) {
  const std::size_t nodes = node_grid(moves, setup).count;
  return windows(moves, {{0, nodes - 1, 0, nodes - 1}}, at_rest(moves), setup).front().x;
}

inline constexpr int kSubsteps = 20;

// The nozzle at every 20th of each interval, 20 (n − 1) + 1 states. The response is exact for a
// base whose acceleration is constant, at its mean, over each 20th.
inline std::vector<dynamics::NozzleState> play(const dynamics::FlexibleAxis& axis,
                                               const dynamics::AxisTrajectory& base,
                                               double period_s, dynamics::NozzleState nozzle) {
  const double step = period_s / kSubsteps;
  std::vector<dynamics::NozzleState> result = {nozzle};
  for (std::size_t k = 0; k + 1 < base.position_mm.size(); ++k) {
    for (int i = 0; i < kSubsteps; ++i) {
      const dynamics::AxisMotion from = dynamics::between(base, k, i * step, period_s);
      const dynamics::AxisMotion middle = dynamics::between(base, k, (i + 0.5) * step, period_s);
      nozzle = dynamics::exact_step(
          axis, nozzle, {from.position_mm, from.velocity_mm_s, middle.accel_mm_s2}, step);
      result.push_back(nozzle);
    }
  }
  return result;
}

// ∫ w (p − r)² dt by Simpson's rule on nodes and middles, plus ρ ∫ (d b̈/dt)² dt; mm²·s.
inline double replayed_objective(const AxisWindow& window, const dynamics::AxisTrajectory& base,
                                 dynamics::NozzleState nozzle) {
  const std::vector<dynamics::NozzleState> p = play(window.axis, base, window.period_s, nozzle);
  const double h = window.period_s;
  double sum = 0.0;
  for (std::size_t k = 0; k + 1 < window.nodes(); ++k) {
    const auto cost = [&](std::size_t half) {
      const double error = p[half * (kSubsteps / 2)].position() - window.reference_mm[half];
      return window.weight[half] * error * error;
    };
    sum += h / 6.0 * (cost(2 * k) + 4.0 * cost(2 * k + 1) + cost(2 * k + 2));
    const double jerk = (base.accel_mm_s2[k + 1] - base.accel_mm_s2[k]) / h;
    sum += window.jerk_weight * std::pow(h, 6) * jerk * jerk * h;
  }
  return sum;
}

}  // namespace unflex::compensate::testing
