#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "axis_problem.hpp"
#include "unflex/collocation/hargraves_paris.hpp"
#include "unflex/compensate/axis_window.hpp"
#include "unflex/nlp/ipopt_solver.hpp"

namespace unflex::compensate {
namespace {

// Relative excess that is rounding, not a broken limit.
constexpr double kSlack = 1e-6;

// Which limits the trajectory breaks, between the nodes too.
ActiveLimits broken(const dynamics::AxisTrajectory& base, const BaseLimits& limits, double h) {
  ActiveLimits result;
  const std::size_t n = base.position_mm.size();
  for (std::size_t k = 0; k < n; ++k) {
    const double b = base.position_mm[k];
    const double v = base.velocity_mm_s[k];
    const double a = base.accel_mm_s2[k];
    result.position = result.position || b < limits.min_position_mm || b > limits.max_position_mm;
    result.accel = result.accel || std::abs(a) > limits.max_accel_mm_s2 * (1.0 + kSlack);
    double fastest = std::abs(v);
    if (k + 1 < n) {
      const double step = base.accel_mm_s2[k + 1] - a;
      result.jerk = result.jerk || std::abs(step) > limits.max_jerk_mm_s3 * h * (1.0 + kSlack);
      if (a * base.accel_mm_s2[k + 1] < 0.0) {
        // b̈ crosses zero inside the interval: ḃ has its extremum there.
        fastest = std::max(fastest, std::abs(v - 0.5 * a * a * h / step));
      }
    }
    result.velocity = result.velocity || fastest > limits.max_velocity_mm_s * (1.0 + kSlack);
  }
  return result;
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
      const ActiveLimits more = broken(solution->base, window.limits, window.period_s);
      const bool all_in = (active.velocity || !more.velocity) && (active.accel || !more.accel) &&
                          (active.jerk || !more.jerk) && (active.position || !more.position);
      if (all_in) {
        return solution;
      }
      active = {active.velocity || more.velocity, active.accel || more.accel,
                active.jerk || more.jerk, active.position || more.position};
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
