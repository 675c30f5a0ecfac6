// Where both axes together want more than a motor has, each gets in proportion to what it wants.
// What neither axis uses is divided evenly, and both are solved again. The solution before keeps
// the new limits too, so no round is worse.
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

bool is_solved(const AxisSolutions& solutions) {
  return solutions[0].has_value() && solutions[1].has_value();
}

double objective(const AxisSolutions& solutions) {
  return solutions[0]->objective + solutions[1]->objective;
}

bool exceeds(const std::vector<double>& x, const std::vector<double>& y, double limit) {
  for (std::size_t k = 0; k < x.size(); ++k) {
    if (std::abs(x[k]) + std::abs(y[k]) > limit * (1.0 + kSlack)) {
      return true;
    }
  }
  return false;
}

// Divides a limit between the axes at all nodes, by what each axis does there.
void divide(const std::vector<double>& x, const std::vector<double>& y, double limit,
            std::vector<double>& limit_of_x, std::vector<double>& limit_of_y) {
  limit_of_x.resize(x.size());
  limit_of_y.resize(x.size());
  for (std::size_t k = 0; k < x.size(); ++k) {
    const double of_x = std::abs(x[k]);
    const double of_y = std::abs(y[k]);
    const double left = limit - of_x - of_y;
    limit_of_x[k] = left > 0.0 ? of_x + 0.5 * left : limit * of_x / (of_x + of_y);
    limit_of_y[k] = limit - limit_of_x[k];
  }
}

void halve(RunWindow& window) {
  for (AxisWindow* const axis : {&window.x, &window.y}) {
    axis->max_velocity_at_mm_s.assign(axis->nodes(), 0.5 * axis->limits.max_velocity_mm_s);
    axis->max_accel_at_mm_s2.assign(axis->nodes(), 0.5 * axis->limits.max_accel_mm_s2);
  }
}

}  // namespace

AxisSolutions solve_with_shared_motors(const Engine& engine, RunWindow& window) {
  const auto solve_both = [&] {
    return AxisSolutions{engine.solve(window.x), engine.solve(window.y)};
  };
  const BaseLimits& limits = window.x.limits;
  AxisSolutions best = solve_both();
  bool divided = false;
  for (int round = 0; round < kMostRounds && is_solved(best); ++round) {
    const dynamics::AxisTrajectory& x = best[0]->base;
    const dynamics::AxisTrajectory& y = best[1]->base;
    const bool too_fast = exceeds(x.velocity_mm_s, y.velocity_mm_s, limits.max_velocity_mm_s);
    const bool too_quick = exceeds(x.accel_mm_s2, y.accel_mm_s2, limits.max_accel_mm_s2);
    if (!divided && !too_fast && !too_quick) {
      break;
    }
    const RunWindow before = window;
    if (too_fast || !window.x.max_velocity_at_mm_s.empty()) {
      divide(x.velocity_mm_s, y.velocity_mm_s, limits.max_velocity_mm_s,
             window.x.max_velocity_at_mm_s, window.y.max_velocity_at_mm_s);
    }
    if (too_quick || !window.x.max_accel_at_mm_s2.empty()) {
      divide(x.accel_mm_s2, y.accel_mm_s2, limits.max_accel_mm_s2, window.x.max_accel_at_mm_s2,
             window.y.max_accel_at_mm_s2);
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
