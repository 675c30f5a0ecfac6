// Runs for tests: a base that follows the plan itself, or a path given in closed form.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <random>
#include <utility>
#include <vector>

#include "unflex/dynamics/base_trajectory.hpp"
#include "unflex/emit/emitter.hpp"
#include "unflex/planner/planner.hpp"

namespace unflex::emit::testing {

inline constexpr double kPeriod_s = 1e-3;

// Position, velocity and acceleration of both axes from a function of time, by differences that are
// exact for parabolas.
inline dynamics::BaseTrajectory sampled(const std::function<std::array<double, 2>(double)>& path,
                                        double duration_s) {
  dynamics::BaseTrajectory base;
  base.period_s = kPeriod_s;
  const auto last = static_cast<std::size_t>(std::llround(duration_s / kPeriod_s));
  for (std::size_t k = 0; k <= last; ++k) {
    const double t = static_cast<double>(k) * kPeriod_s;
    const double d = 0.25 * kPeriod_s;
    const auto before = path(std::max(t - d, 0.0));
    const auto at = path(t);
    const auto after = path(std::min(t + d, duration_s));
    dynamics::AxisTrajectory* axes[] = {&base.x, &base.y};
    for (std::size_t axis = 0; axis < 2; ++axis) {
      axes[axis]->position_mm.push_back(at[axis]);
      axes[axis]->velocity_mm_s.push_back((after[axis] - before[axis]) / (2.0 * d));
      axes[axis]->accel_mm_s2.push_back((after[axis] - 2.0 * at[axis] + before[axis]) / (d * d));
    }
  }
  return base;
}

// X and Y of the plan at a time after its start. It rests before its start and after its end.
inline std::array<double, 2> plan_at(const std::vector<planner::PlannedMove>& moves, double t) {
  std::size_t i = 0;
  while (i + 1 < moves.size() && t > moves[i].duration_s()) {
    t -= moves[i++].duration_s();
  }
  const gcode::Position p = moves[i].position_mm(t);
  return {p[gcode::X], p[gcode::Y]};
}

// A base that follows the plan, with a lead-in and a tail of rest.
inline dynamics::BaseTrajectory plan_as_base(const std::vector<planner::PlannedMove>& moves,
                                             double lead_in_s = 0.0) {
  const double nodes = std::ceil((lead_in_s + duration_s(moves) + 2e-3) / kPeriod_s);
  return sampled([&](double t) { return plan_at(moves, t - lead_in_s); }, nodes * kPeriod_s);
}

// An axis that starts at rest at 50 mm, with these accelerations at its nodes, linear in between.
inline dynamics::AxisTrajectory accelerated(std::vector<double> accel_mm_s2) {
  dynamics::AxisTrajectory axis;
  double position = 50.0;
  double velocity = 0.0;
  for (std::size_t k = 0; k < accel_mm_s2.size(); ++k) {
    axis.position_mm.push_back(position);
    axis.velocity_mm_s.push_back(velocity);
    const double a = accel_mm_s2[k];
    const double next = k + 1 < accel_mm_s2.size() ? accel_mm_s2[k + 1] : 0.0;
    position += kPeriod_s * (velocity + kPeriod_s * (2.0 * a + next) / 6.0);
    velocity += kPeriod_s * 0.5 * (a + next);
  }
  axis.accel_mm_s2 = std::move(accel_mm_s2);
  return axis;
}

// A base from rest to rest that accelerates by the largest allowed value nearly all the time: for a
// few nodes one way, for a few nodes the other way, each axis at its own times. From the middle on,
// the motion is reversed in time and sign.
inline dynamics::BaseTrajectory bang_bang(unsigned seed, double accel_mm_s2, std::size_t half) {
  std::mt19937 random(seed);
  std::uniform_int_distribution<std::size_t> nodes(2, 7);
  dynamics::BaseTrajectory base;
  base.period_s = kPeriod_s;
  for (dynamics::AxisTrajectory* axis : {&base.x, &base.y}) {
    std::vector<double> accel;
    double sign = 1.0;
    while (accel.size() < half) {
      accel.insert(accel.end(), nodes(random), sign * accel_mm_s2);
      sign = -sign;
    }
    accel.resize(half);
    for (std::size_t k = half; k-- > 0;) {
      accel.push_back(-accel[k]);
    }
    *axis = accelerated(std::move(accel));
  }
  return base;
}

inline EmitOptions options() {
  EmitOptions options;
  options.run_limits = {1200.0, 1e6, 1000.0, 0.0, 1e6};
  options.interpreter.shaper_freq_hz.x = 45.0;
  options.interpreter.shaper_freq_hz.y = 45.0;
  options.version = "test";
  return options;
}

}  // namespace unflex::emit::testing
