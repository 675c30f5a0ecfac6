#include "limits.hpp"

#include <algorithm>
#include <cmath>

#include "unflex/core/math.hpp"

namespace unflex::compensate {
namespace {

// A relative excess up to this is rounding, not a broken limit.
constexpr double kSlack = 1e-6;
// An excess of a position up to this is rounding: a tenth of the grid that positions are written
// on.
constexpr double kPositionSlackMm = 1e-5;

// How far the base is beyond its travel; negative inside.
double beyond_travel(const dynamics::AxisMotion& motion, const BaseLimits& limits) {
  return std::max(limits.min_position_mm - motion.position_mm,
                  motion.position_mm - limits.max_position_mm);
}

// Whether b leaves its travel between nodes k and k+1. It can do so only at a turning point, where
// ḃ = v + a s + j s²/2 is zero.
bool leaves_travel_between(const dynamics::AxisTrajectory& base, std::size_t k,
                           const BaseLimits& limits, double h) {
  const double v = base.velocity_mm_s[k];
  const double a = base.accel_mm_s2[k];
  const double step = base.accel_mm_s2[k + 1] - a;
  // b goes no further than this from node k. Nearly always that is far from both ends of the
  // travel.
  const double reach = (std::abs(v) + (0.5 * std::abs(a) + std::abs(step) / 6.0) * h) * h;
  if (beyond_travel({base.position_mm[k], v, a}, limits) + reach < 0.0) {
    return false;
  }
  const double j = step / h;
  const double discriminant = a * a - 2.0 * j * v;
  if (discriminant < 0.0) {
    return false;
  }
  // The two roots without cancellation: q/(j/2) and v/q.
  const double q = -0.5 * (a + std::copysign(std::sqrt(discriminant), a));
  for (const double s : {2.0 * q / j, v / q}) {
    if (s > 0.0 && s < h &&
        beyond_travel(dynamics::between(base, k, s, h), limits) > kPositionSlackMm) {
      return true;
    }
  }
  return false;
}

// Sets bounds of b and b̈ that keep the base within its travel. resting_mm is set if the base rests
// at this node.
void bound_position(const AxisWindow& window, bool between, std::optional<double> resting_mm,
                    BaseBounds& bounds) {
  const BaseLimits& limits = window.limits;
  double margin = 0.0;
  if (between && std::isfinite(limits.max_accel_mm_s2)) {
    // Between nodes b departs from the chord by at most A h²/8.
    margin = std::min(limits.max_accel_mm_s2 * math::square(window.period_s) / 8.0,
                      0.5 * (limits.max_position_mm - limits.min_position_mm));
    // If the base rests closer to the end of the travel than the margin, it can only set off
    // inwards.
    if (resting_mm && *resting_mm < limits.min_position_mm + margin) {
      bounds.accel.lower = 0.0;
    }
    if (resting_mm && *resting_mm > limits.max_position_mm - margin) {
      bounds.accel.upper = 0.0;
    }
  }
  bounds.position = {limits.min_position_mm + margin, limits.max_position_mm - margin};
}

}  // namespace

bool Interval::bounded() const { return std::isfinite(lower) || std::isfinite(upper); }

std::optional<double> resting_base_mm(const AxisWindow& window, std::size_t k) {
  if (k == 0 && window.start) {
    return window.start->base_mm;
  }
  if (k + 1 == window.nodes()) {
    return window.end_base_mm;
  }
  return std::nullopt;
}

// V and A at a node.
double max_velocity(const AxisWindow& window, std::size_t k) {
  return window.max_velocity_at_mm_s.empty()
             ? window.limits.max_velocity_mm_s
             : std::min(window.max_velocity_at_mm_s[k], window.limits.max_velocity_mm_s);
}

double max_accel(const AxisWindow& window, std::size_t k) {
  return window.max_accel_at_mm_s2.empty()
             ? window.limits.max_accel_mm_s2
             : std::min(window.max_accel_at_mm_s2[k], window.limits.max_accel_mm_s2);
}

BaseBounds base_bounds(const AxisWindow& window, ActiveLimits active, std::size_t k) {
  const BaseLimits& limits = window.limits;
  BaseBounds bounds;
  if (active.velocity) {
    // ḃ is a parabola between nodes and may exceed its values there by up to A h/4 (b̈ from A to
    // −A).
    const double margin = std::isfinite(limits.max_accel_mm_s2)
                              ? limits.max_accel_mm_s2 * window.period_s / 4.0
                              : 0.0;
    bounds.velocity.upper = std::max(max_velocity(window, k) - margin, 0.0);
    bounds.velocity.lower = -bounds.velocity.upper;
  }
  if (active.accel) {
    bounds.accel.upper = max_accel(window, k);
    bounds.accel.lower = -bounds.accel.upper;
  }
  if (active.position) {
    bound_position(window, active.position_between, resting_base_mm(window, k), bounds);
  }
  return bounds;
}

ActiveLimits broken(const dynamics::AxisTrajectory& base, const BaseLimits& limits, double h) {
  ActiveLimits result;
  const std::size_t n = base.position_mm.size();
  for (std::size_t k = 0; k < n; ++k) {
    const double v = base.velocity_mm_s[k];
    const double a = base.accel_mm_s2[k];
    result.position =
        result.position || beyond_travel({base.position_mm[k], v, a}, limits) > kPositionSlackMm;
    result.accel = result.accel || std::abs(a) > limits.max_accel_mm_s2 * (1.0 + kSlack);
    double fastest = std::abs(v);
    if (k + 1 < n) {
      const double step = base.accel_mm_s2[k + 1] - a;
      result.jerk = result.jerk || std::abs(step) > limits.max_jerk_mm_s3 * h * (1.0 + kSlack);
      if (a * base.accel_mm_s2[k + 1] < 0.0) {
        // b̈ crosses zero inside the interval, and ḃ has its extremum there.
        fastest = std::max(fastest, std::abs(v - 0.5 * a * a * h / step));
      }
      result.position_between =
          result.position_between || leaves_travel_between(base, k, limits, h);
    }
    result.velocity = result.velocity || fastest > limits.max_velocity_mm_s * (1.0 + kSlack);
  }
  return result;
}

ActiveLimits broken(const dynamics::AxisTrajectory& base, const AxisWindow& window) {
  ActiveLimits result = broken(base, window.limits, window.period_s);
  const auto beyond = [&](const std::vector<double>& values, const std::vector<double>& most) {
    for (std::size_t k = 0; k < most.size(); ++k) {
      if (std::abs(values[k]) > most[k] * (1.0 + kSlack)) {
        return true;
      }
    }
    return false;
  };
  result.velocity = result.velocity || beyond(base.velocity_mm_s, window.max_velocity_at_mm_s);
  result.accel = result.accel || beyond(base.accel_mm_s2, window.max_accel_at_mm_s2);
  return result;
}

ActiveLimits tightened(const ActiveLimits& active, const ActiveLimits& more) {
  return {active.velocity || more.velocity, active.accel || more.accel, active.jerk || more.jerk,
          active.position || more.position || more.position_between,
          active.position_between || (more.position_between && !more.position)};
}

Result<AxisSolution> solve_within_limits(
    const AxisWindow& window,
    const std::function<Result<AxisSolution>(const ActiveLimits&)>& solve_with) {
  ActiveLimits active;
  int iterations = 0;
  for (;;) {
    Result<AxisSolution> solution = solve_with(active);
    if (!solution) {
      return solution;
    }
    iterations += solution->iterations;
    solution->iterations = iterations;
    const ActiveLimits next = tightened(active, broken(solution->base, window));
    if (next == active) {
      return solution;
    }
    active = next;
  }
}

}  // namespace unflex::compensate
