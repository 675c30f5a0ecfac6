#include "unflex/nlp/ipopt_solver.hpp"

#include <IpoptConfig.h>
#include <fmt/core.h>

#include <IpIpoptApplication.hpp>
#include <IpSolveStatistics.hpp>
#include <IpTNLP.hpp>
#include <algorithm>
#include <cmath>
#include <utility>

namespace unflex::nlp {
namespace {

using Ipopt::Index;
using Ipopt::Number;

std::span<const double> view(const Number* data, Index size) {
  return {data, static_cast<std::size_t>(size)};
}

std::span<double> view(Number* data, Index size) { return {data, static_cast<std::size_t>(size)}; }

// Hands a Problem to Ipopt and takes the solution back.
class Adapter final : public Ipopt::TNLP {
 public:
  explicit Adapter(const Problem& problem) : problem_(&problem) {}

  Solution take() { return std::move(solution_); }

  bool get_nlp_info(Index& n, Index& m, Index& nnz_jac_g, Index& nnz_h_lag,
                    IndexStyleEnum& index_style) override {
    n = static_cast<Index>(problem_->start().size());
    m = static_cast<Index>(problem_->constraint_bounds().lower.size());
    nnz_jac_g = static_cast<Index>(problem_->jacobian_sparsity().row.size());
    nnz_h_lag = static_cast<Index>(problem_->hessian_sparsity().row.size());
    index_style = TNLP::C_STYLE;
    return true;
  }

  bool get_bounds_info(Index /*n*/, Number* x_l, Number* x_u, Index /*m*/, Number* g_l,
                       Number* g_u) override {
    std::ranges::copy(problem_->variable_bounds().lower, x_l);
    std::ranges::copy(problem_->variable_bounds().upper, x_u);
    std::ranges::copy(problem_->constraint_bounds().lower, g_l);
    std::ranges::copy(problem_->constraint_bounds().upper, g_u);
    return true;
  }

  bool get_starting_point(Index /*n*/, bool init_x, Number* x, bool init_z, Number* /*z_L*/,
                          Number* /*z_U*/, Index /*m*/, bool init_lambda,
                          Number* /*lambda*/) override {
    if (!init_x || init_z || init_lambda) {
      return false;
    }
    std::ranges::copy(problem_->start(), x);
    return true;
  }

  bool eval_f(Index n, const Number* x, bool /*new_x*/, Number& value) override {
    value = problem_->objective(view(x, n));
    return std::isfinite(value);
  }

  bool eval_grad_f(Index n, const Number* x, bool /*new_x*/, Number* gradient) override {
    problem_->gradient(view(x, n), view(gradient, n));
    return true;
  }

  bool eval_g(Index n, const Number* x, bool /*new_x*/, Index m, Number* g) override {
    problem_->constraints(view(x, n), view(g, m));
    return true;
  }

  bool eval_jac_g(Index n, const Number* x, bool /*new_x*/, Index /*m*/, Index nonzeros, Index* row,
                  Index* column, Number* values) override {
    if (values == nullptr) {
      std::ranges::copy(problem_->jacobian_sparsity().row, row);
      std::ranges::copy(problem_->jacobian_sparsity().column, column);
    } else {
      problem_->jacobian(view(x, n), view(values, nonzeros));
    }
    return true;
  }

  bool eval_h(Index n, const Number* x, bool /*new_x*/, Number sigma, Index m, const Number* lambda,
              bool /*new_lambda*/, Index nonzeros, Index* row, Index* column,
              Number* values) override {
    if (values == nullptr) {
      std::ranges::copy(problem_->hessian_sparsity().row, row);
      std::ranges::copy(problem_->hessian_sparsity().column, column);
    } else {
      problem_->hessian(view(x, n), sigma, view(lambda, m), view(values, nonzeros));
    }
    return true;
  }

  void finalize_solution(Ipopt::SolverReturn status, Index n, const Number* x,
                         const Number* /*z_L*/, const Number* /*z_U*/, Index m, const Number* g,
                         const Number* lambda, Number objective, const Ipopt::IpoptData* /*data*/,
                         Ipopt::IpoptCalculatedQuantities* /*quantities*/) override {
    solution_.x.assign(x, x + n);
    solution_.lambda.assign(lambda, lambda + m);
    solution_.objective = objective;
    solution_.outcome = status == Ipopt::SUCCESS || status == Ipopt::STOP_AT_ACCEPTABLE_POINT
                            ? Outcome::solved
                            : Outcome::not_converged;
    if (solution_.outcome != Outcome::solved) {
      solution_.message = describe(status, view(g, m));
    }
  }

 private:
  std::string describe(Ipopt::SolverReturn status, std::span<const double> g) const {
    const Bounds& bounds = problem_->constraint_bounds();
    double worst = 0.0;
    int worst_index = -1;
    for (std::size_t i = 0; i < g.size(); ++i) {
      const double violation = std::max(bounds.lower[i] - g[i], g[i] - bounds.upper[i]);
      if (violation > worst) {
        worst = violation;
        worst_index = static_cast<int>(i);
      }
    }
    if (worst_index < 0) {
      return fmt::format("ipopt status {}", static_cast<int>(status));
    }
    return fmt::format("ipopt status {}, worst violation {:.3g} in {}", static_cast<int>(status),
                       worst, problem_->constraint_name(worst_index));
  }

  const Problem* problem_;
  Solution solution_;
};

// These powers of ten take the fewest iterations over the windows of the corner example.
constexpr double kWarmPush = 1e-4;
constexpr double kWarmBarrier = 1e-3;

// Sets options, and keeps the name of the first one that Ipopt refuses.
class OptionSetter {
 public:
  explicit OptionSetter(Ipopt::IpoptApplication& application)
      : options_(Ipopt::GetRawPtr(application.Options())) {}

  void set(const char* name, const char* value) {
    note(name, options_->SetStringValue(name, value));
  }
  void set(const char* name, double value) { note(name, options_->SetNumericValue(name, value)); }
  void set(const char* name, int value) { note(name, options_->SetIntegerValue(name, value)); }

  [[nodiscard]] const std::string& refused() const { return refused_; }

 private:
  void note(const char* name, bool accepted) {
    if (!accepted && refused_.empty()) {
      refused_ = name;
    }
  }
  Ipopt::OptionsList* options_;
  std::string refused_;
};

}  // namespace

Result<Solution> solve(const Problem& problem, const SolverOptions& options) {
  Ipopt::SmartPtr<Ipopt::IpoptApplication> application = new Ipopt::IpoptApplication(false);
  OptionSetter setter(*application);
  setter.set("print_level", 0);
  setter.set("sb", "yes");
  setter.set("linear_solver", "mumps");
  // The unknowns are scaled to about 1 already. So MUMPS' own scaling and Ipopt's cost more than
  // they bring.
  setter.set("mumps_scaling", 0);
  setter.set("mumps_permuting_scaling", 0);
  setter.set("nlp_scaling_method", "none");
  // On banded programs of some thousand unknowns, approximate minimum degree orders better than
  // MUMPS' automatic choice. No refinement steps and the loqo oracle save backsolves. Together this
  // is 2.3 times faster.
  setter.set("mumps_pivot_order", 0);
  setter.set("min_refinement_steps", 0);
  setter.set("mu_strategy", "adaptive");
  setter.set("mu_oracle", "loqo");
  setter.set("tol", options.tolerance);
  setter.set("max_iter", options.max_iterations);
  if (options.warm) {
    // By default Ipopt moves the start 1 % away from all bounds and lets the barrier begin high.
    setter.set("bound_push", kWarmPush);
    setter.set("bound_frac", kWarmPush);
    setter.set("slack_bound_push", kWarmPush);
    setter.set("slack_bound_frac", kWarmPush);
    setter.set("mu_strategy", "monotone");
    setter.set("mu_init", kWarmBarrier);
    setter.set("bound_mult_init_method", "mu-based");
  }
  if (problem.linear_constraints()) {
    setter.set("jac_c_constant", "yes");
    setter.set("jac_d_constant", "yes");
    if (problem.quadratic_objective()) {
      setter.set("hessian_constant", "yes");
    }
  }
  if (!setter.refused().empty() || application->Initialize("") != Ipopt::Solve_Succeeded) {
    return fail(
        ErrorKind::internal,
        fmt::format("ipopt refuses {}", setter.refused().empty()
                                            ? "to begin"
                                            : fmt::format("the option '{}'", setter.refused())));
  }
  Ipopt::SmartPtr<Adapter> adapter = new Adapter(problem);
  const Ipopt::ApplicationReturnStatus status =
      application->OptimizeTNLP(Ipopt::SmartPtr<Ipopt::TNLP>(Ipopt::GetRawPtr(adapter)));
  Solution solution = adapter->take();
  if (solution.x.empty() && solution.message.empty()) {
    // Ipopt never called finalize_solution: too few degrees of freedom, a bad number, or no memory.
    solution.message =
        fmt::format("ipopt stopped with application status {}", static_cast<int>(status));
  }
  if (Ipopt::IsValid(application->Statistics())) {
    solution.iterations = application->Statistics()->IterationCount();
  }
  return solution;
}

std::string solver_version() { return std::string("ipopt ") + IPOPT_VERSION; }

}  // namespace unflex::nlp
