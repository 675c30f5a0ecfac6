#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "axis_problem.hpp"
#include "unflex/collocation/hargraves_paris.hpp"
#include "unflex/compensate/axis_window.hpp"
#include "unflex/nlp/ipopt_solver.hpp"

namespace unflex::compensate {
namespace {

// Relative excess that is rounding, not a broken limit.
constexpr double kSlack = 1e-6;
// The same for positions: a tenth of the grid that they are written on.
constexpr double kPositionSlackMm = 1e-5;

// How far the base is beyond its travel; negative inside.
double beyond_travel(const dynamics::AxisMotion& motion, const BaseLimits& limits) {
  return std::max(limits.min_position_mm - motion.position_mm,
                  motion.position_mm - limits.max_position_mm);
}

// Whether b leaves its travel between nodes k and k+1: at a turning point, where
// ḃ = v + a s + j s²/2 is zero.
bool leaves_travel_between(const dynamics::AxisTrajectory& base, std::size_t k,
                           const BaseLimits& limits, double h) {
  const double v = base.velocity_mm_s[k];
  const double a = base.accel_mm_s2[k];
  const double j = (base.accel_mm_s2[k + 1] - a) / h;
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

// Which limits the trajectory breaks, between the nodes too.
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
        // b̈ crosses zero inside the interval: ḃ has its extremum there.
        fastest = std::max(fastest, std::abs(v - 0.5 * a * a * h / step));
      }
      result.position_between =
          result.position_between || leaves_travel_between(base, k, limits, h);
    }
    result.velocity = result.velocity || fastest > limits.max_velocity_mm_s * (1.0 + kSlack);
  }
  return result;
}

// The limits in force, and those broken in spite of them. The travel between nodes only counts
// where the nodes keep it.
ActiveLimits tightened(const ActiveLimits& active, const ActiveLimits& more) {
  return {active.velocity || more.velocity, active.accel || more.accel, active.jerk || more.jerk,
          active.position || more.position || more.position_between,
          active.position_between || (more.position_between && !more.position)};
}

class IpoptEngine final : public Engine {
 public:
  // Most windows keep all limits by themselves. So the program starts without them, and only those
  // that its solution breaks are put in; the result is the optimum under all of them.
  Result<AxisSolution> solve(const AxisWindow& window) const override {
    ActiveLimits active;
    int iterations = 0;
    for (;;) {
      Result<AxisSolution> solution = solve_with(window, active);
      if (!solution) {
        return solution;
      }
      iterations += solution->iterations;
      solution->iterations = iterations;
      const ActiveLimits next =
          tightened(active, broken(solution->base, window.limits, window.period_s));
      if (next == active) {
        return solution;
      }
      active = next;
    }
  }

  std::string name() const override { return nlp::solver_version(); }

 private:
  static Result<AxisSolution> solve_with(const AxisWindow& window, ActiveLimits active) {
    const AxisProblem problem(window, active);
    const std::size_t n = window.nodes();
    std::vector<double> times(n);
    for (std::size_t k = 0; k < n; ++k) {
      times[k] = static_cast<double>(k);
    }
    const auto program = collocation::transcribe(problem, std::move(times));
    Result<nlp::Solution> solution = nlp::solve(*program, nlp::SolverOptions{});
    if (!solution) {
      return tl::unexpected(solution.error());
    }
    if (solution->outcome != nlp::Outcome::solved) {
      return fail(ErrorKind::internal, solution->message);
    }
    AxisSolution result;
    result.iterations = solution->iterations;
    result.objective = solution->objective * kLengthUnitMm * kLengthUnitMm * window.period_s;
    result.base.position_mm.resize(n);
    result.base.velocity_mm_s.resize(n);
    result.base.accel_mm_s2.resize(n);
    for (std::size_t k = 0; k < n; ++k) {
      const auto z = collocation::node(problem, solution->x, static_cast<int>(k));
      const auto at = [&](AxisProblem::Component c) { return problem.to_physical(c, z(c)); };
      result.base.position_mm[k] = at(AxisProblem::kBase);
      result.base.velocity_mm_s[k] = at(AxisProblem::kBaseRate);
      result.base.accel_mm_s2[k] = at(AxisProblem::kBaseAccel);
    }
    return result;
  }
};

}  // namespace

std::unique_ptr<Engine> make_ipopt_engine() { return std::make_unique<IpoptEngine>(); }

}  // namespace unflex::compensate
