// Windows to solve: seeded random windows, and their solution by Ipopt.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <random>
#include <vector>

#include "axis_problem.hpp"
#include "unflex/collocation/hargraves_paris.hpp"
#include "unflex/compensate/axis_window.hpp"
#include "unflex/nlp/ipopt_solver.hpp"

namespace unflex::compensate::testing {

struct WindowKind {
  double omega_rad_s = 282.7;
  double zeta = 0.06;
  double period_s = 1e-3;
  bool start = true;
  bool end = true;
};

// A path with trapezoidal speed from corner to corner, up to 100 mm/s and 5000 mm/s², somewhere on
// the bed; part of it is travel.
inline AxisWindow random_path(std::mt19937_64& random, std::size_t nodes, const WindowKind& kind) {
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  AxisWindow window;
  window.axis = {kind.omega_rad_s, kind.zeta};
  window.period_s = kind.period_s;
  window.jerk_weight = 1.5 * std::pow(kind.omega_rad_s * kind.period_s, 4);
  double position = 100.0 + 80.0 * uniform(random);
  double velocity = 0.0;
  double target = 0.0;
  double weight = 1.0;
  const double step = 0.5 * kind.period_s;
  const std::size_t samples = 2 * nodes - 1;
  std::size_t next_corner = samples / 12;
  const std::size_t stop = samples - std::min<std::size_t>(samples / 8 + 2, samples);
  for (std::size_t i = 0; i < samples; ++i) {
    if (i >= next_corner) {
      target = 100.0 * uniform(random);
      weight = uniform(random) > -0.4 ? 1.0 : 0.1;
      next_corner += 20 + static_cast<std::size_t>(40.0 * (1.0 + uniform(random)));
    }
    if (i >= stop) {
      target = 0.0;
    }
    window.reference_mm.push_back(position);
    window.weight.push_back(weight);
    velocity += std::clamp(target - velocity, -5000.0 * step, 5000.0 * step);
    position += velocity * step;
  }
  if (kind.start) {
    window.start =
        AxisWindow::Start{{window.reference_mm.front() + 0.01 * uniform(random), uniform(random)},
                          window.reference_mm.front()};
  }
  if (kind.end) {
    window.end_base_mm = window.reference_mm.back();
  }
  return window;
}

// Before it begins, Ipopt moves every bound outwards by 10⁻⁸ of its scaled size, at least by 10⁻⁸.
// With these limits it keeps those of the window.
inline BaseLimits before_ipopt_relaxes(const AxisWindow& window) {
  const double h = window.period_s;
  const double origin_mm = window.reference_mm.front();
  const auto share = [](double physical, double unit) {
    return 1e-8 * std::max(unit, std::abs(physical));
  };
  BaseLimits limits = window.limits;
  limits.max_velocity_mm_s -= share(limits.max_velocity_mm_s, kLengthUnitMm / h);
  limits.max_accel_mm_s2 -= share(limits.max_accel_mm_s2, kLengthUnitMm / (h * h));
  limits.max_jerk_mm_s3 -= share(limits.max_jerk_mm_s3, kLengthUnitMm / (h * h * h));
  limits.min_position_mm += share(limits.min_position_mm - origin_mm, kLengthUnitMm);
  limits.max_position_mm -= share(limits.max_position_mm - origin_mm, kLengthUnitMm);
  return limits;
}

// The window's optimum by Ipopt, under the limits of `active` and to this tolerance.
inline Result<AxisSolution> solve_by_ipopt(AxisWindow window, const ActiveLimits& active,
                                           double tolerance) {
  const BaseLimits given = before_ipopt_relaxes(window);
  for (auto member :
       {&BaseLimits::max_velocity_mm_s, &BaseLimits::max_accel_mm_s2, &BaseLimits::max_jerk_mm_s3,
        &BaseLimits::min_position_mm, &BaseLimits::max_position_mm}) {
    if (std::isfinite(window.limits.*member)) {
      window.limits.*member = given.*member;
    }
  }
  const AxisProblem problem(window, active);
  std::vector<double> times(window.nodes());
  for (std::size_t k = 0; k < times.size(); ++k) {
    times[k] = static_cast<double>(k);
  }
  const auto program = collocation::transcribe(problem, times);
  const Result<nlp::Solution> solution =
      nlp::solve(*program, {.tolerance = tolerance, .max_iterations = 500});
  if (!solution) {
    return tl::unexpected(solution.error());
  }
  if (solution->outcome != nlp::Outcome::solved) {
    return fail(ErrorKind::internal, solution->message);
  }
  AxisSolution result;
  result.objective = solution->objective * kLengthUnitMm * kLengthUnitMm * window.period_s;
  for (std::size_t k = 0; k < window.nodes(); ++k) {
    const auto z = collocation::node(problem, solution->x, static_cast<int>(k));
    const auto at = [&](AxisProblem::Component c) {
      return problem.to_physical(c, z(problem.place(c)));
    };
    result.base.position_mm.push_back(at(AxisProblem::kBase));
    result.base.velocity_mm_s.push_back(at(AxisProblem::kBaseRate));
    result.base.accel_mm_s2.push_back(at(AxisProblem::kBaseAccel));
  }
  return result;
}

inline double largest_difference(const std::vector<double>& a, const std::vector<double>& b) {
  double largest = a.size() == b.size() ? 0.0 : std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
    largest = std::max(largest, std::abs(a[i] - b[i]));
  }
  return largest;
}

inline double largest(const std::vector<double>& values) {
  double result = 0.0;
  for (const double value : values) {
    result = std::max(result, std::abs(value));
  }
  return result;
}

}  // namespace unflex::compensate::testing
