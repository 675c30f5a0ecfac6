#include <fmt/core.h>

#include <utility>

#include "axis_problem.hpp"
#include "limits.hpp"
#include "unflex/collocation/hargraves_paris.hpp"
#include "unflex/compensate/axis_window.hpp"
#include "unflex/nlp/ipopt_solver.hpp"

namespace unflex::compensate {
namespace {

class IpoptEngine final : public Engine {
 public:
  Result<AxisSolution> solve(const AxisWindow& window) const override {
    return solve_within_limits(
        window, [&](const ActiveLimits& active) { return solve_with(window, active); });
  }

  std::string name() const override { return nlp::solver_version(); }

 private:
  static Result<AxisSolution> solve_with(const AxisWindow& window, ActiveLimits active) {
    const AxisProblem problem(window, active);
    if (problem.states() > collocation::kMaxStates) {
      return fail(
          ErrorKind::internal,
          fmt::format("{} states are more than Ipopt is given, {}; the banded engine takes them",
                      problem.states(), collocation::kMaxStates));
    }
    const std::size_t n = window.nodes();
    std::vector<double> times(n);
    for (std::size_t k = 0; k < n; ++k) {
      times[k] = static_cast<double>(k);
    }
    const auto program = collocation::transcribe(problem, std::move(times));
    Result<nlp::Solution> solution = nlp::solve(*program, {.warm = window.guess.has_value()});
    if (!solution) {
      return tl::unexpected(solution.error());
    }
    if (solution->outcome != nlp::Outcome::solved) {
      return fail(ErrorKind::internal, solution->message);
    }
    AxisSolution result;
    result.iterations = solution->iterations;
    result.size = {program->variable_bounds().lower.size(),
                   program->constraint_bounds().lower.size()};
    result.objective = solution->objective * kLengthUnitMm * kLengthUnitMm * window.period_s;
    result.base.position_mm.resize(n);
    result.base.velocity_mm_s.resize(n);
    result.base.accel_mm_s2.resize(n);
    for (std::size_t k = 0; k < n; ++k) {
      const auto z = collocation::node(problem, solution->x, static_cast<int>(k));
      const auto at = [&](AxisProblem::Component c) {
        return problem.to_physical(c, z(problem.place(c)));
      };
      result.base.position_mm[k] = at(AxisProblem::kBase);
      result.base.velocity_mm_s[k] = at(AxisProblem::kBaseRate);
      result.base.accel_mm_s2[k] = at(AxisProblem::kBaseAccel);
    }
    return result;
  }
};

}  // namespace

bool has_ipopt_engine() { return true; }

std::unique_ptr<Engine> make_ipopt_engine() { return std::make_unique<IpoptEngine>(); }

}  // namespace unflex::compensate
