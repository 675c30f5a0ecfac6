// Where both axes together ask for more than a motor's limit, the limit is divided in proportion to
// what each axis asks for. The part that neither axis uses is divided evenly. Then both axes are
// solved again. The previous solution keeps the new limits too, so no round is worse.
#include "shared_motors.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

namespace unflex::compensate {
namespace {

constexpr int kMostRounds = 6;
// If a round gains less than this share of the cost, it is the last.
constexpr double kGain = 0.01;
// A relative excess up to this is rounding.
constexpr double kSlack = 1e-6;

// A motion of both axes at the nodes: their velocities, or their accelerations.
using Nodes = std::vector<double> dynamics::AxisTrajectory::*;

bool is_solved(const AxisSolutions& solutions) {
  return all_axes([](const auto& solution) { return solution.has_value(); }, solutions);
}

double objective(const AxisSolutions& solutions) {
  return sum_of_axes([](const auto& solution) { return solution->objective; }, solutions);
}

Axes<double> at_node(const AxisSolutions& solutions, Nodes nodes, std::size_t k) {
  return map_axes([&](const auto& solution) { return std::abs((solution->base.*nodes)[k]); },
                  solutions);
}

bool exceeds(const AxisSolutions& solutions, Nodes nodes, double limit) {
  for (std::size_t k = 0; k < (solutions.x->base.*nodes).size(); ++k) {
    if (taxicab(at_node(solutions, nodes, k)) > limit * (1.0 + kSlack)) {
      return true;
    }
  }
  return false;
}

// Divides a limit between the axes at all nodes, by what each axis does there.
void divide(const AxisSolutions& solutions, Nodes nodes, double limit,
            std::vector<double> AxisWindow::*limit_at, RunWindow& window) {
  for_each_axis([&](AxisWindow& axis) { (axis.*limit_at).resize(axis.nodes()); }, window);
  for (std::size_t k = 0; k < window.x.nodes(); ++k) {
    const auto [of_x, of_y] = at_node(solutions, nodes, k);
    const double left = limit - of_x - of_y;
    const double limit_of_x = left > 0.0 ? of_x + 0.5 * left : limit * of_x / (of_x + of_y);
    (window.x.*limit_at)[k] = limit_of_x;
    (window.y.*limit_at)[k] = limit - limit_of_x;
  }
}

void halve(RunWindow& window) {
  for_each_axis(
      [](AxisWindow& axis) {
        axis.max_velocity_at_mm_s.assign(axis.nodes(), 0.5 * axis.limits.max_velocity_mm_s);
        axis.max_accel_at_mm_s2.assign(axis.nodes(), 0.5 * axis.limits.max_accel_mm_s2);
      },
      window);
}

}  // namespace

AxisSolutions solve_with_shared_motors(const Engine& engine, RunWindow& window) {
  const auto solve_both = [&] {
    return AxisSolutions{
        map_axes([&](const AxisWindow& axis) { return engine.solve(axis); }, window)};
  };
  const BaseLimits& limits = window.x.limits;
  AxisSolutions best = solve_both();
  bool divided = false;
  for (int round = 0; round < kMostRounds && is_solved(best); ++round) {
    constexpr Nodes kVelocity = &dynamics::AxisTrajectory::velocity_mm_s;
    constexpr Nodes kAccel = &dynamics::AxisTrajectory::accel_mm_s2;
    const bool too_fast = exceeds(best, kVelocity, limits.max_velocity_mm_s);
    const bool too_quick = exceeds(best, kAccel, limits.max_accel_mm_s2);
    if (!divided && !too_fast && !too_quick) {
      break;
    }
    const RunWindow before = window;
    if (too_fast || !window.x.max_velocity_at_mm_s.empty()) {
      divide(best, kVelocity, limits.max_velocity_mm_s, &AxisWindow::max_velocity_at_mm_s, window);
    }
    if (too_quick || !window.x.max_accel_at_mm_s2.empty()) {
      divide(best, kAccel, limits.max_accel_mm_s2, &AxisWindow::max_accel_at_mm_s2, window);
    }
    AxisSolutions next = solve_both();
    const bool solved = is_solved(next);
    if (divided && (!solved || objective(next) > objective(best))) {
      window = before;
      break;
    }
    if (!solved) {
      halve(window);
      return solve_both();
    }
    const bool gains = !divided || objective(next) < (1.0 - kGain) * objective(best);
    best = std::move(next);
    divided = true;
    if (!gains) {
      break;
    }
  }
  return best;
}

}  // namespace unflex::compensate
