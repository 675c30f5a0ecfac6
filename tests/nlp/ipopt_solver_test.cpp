#include "unflex/nlp/ipopt_solver.hpp"

#include <fmt/core.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <random>
#include <utility>

namespace unflex::nlp {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

// A small program with dense derivatives, given by functions.
struct Functions {
  std::function<double(std::span<const double>)> f;
  std::function<void(std::span<const double>, std::span<double>)> gradient;
  std::function<void(std::span<const double>, std::span<double>)> g;
  // Row by row; lower triangle row by row.
  std::function<void(std::span<const double>, std::span<double>)> jacobian;
  std::function<void(std::span<const double>, double, std::span<const double>, std::span<double>)>
      hessian;
};

class SmallProblem : public Problem {
 public:
  SmallProblem(Bounds variables, Bounds constraints, std::vector<double> start, Functions functions)
      : variables_(std::move(variables)),
        constraints_(std::move(constraints)),
        start_(std::move(start)),
        functions_(std::move(functions)) {
    const auto n = static_cast<int>(start_.size());
    for (int row = 0; row < static_cast<int>(constraints_.lower.size()); ++row) {
      for (int column = 0; column < n; ++column) {
        jacobian_.row.push_back(row);
        jacobian_.column.push_back(column);
      }
    }
    for (int row = 0; row < n; ++row) {
      for (int column = 0; column <= row; ++column) {
        hessian_.row.push_back(row);
        hessian_.column.push_back(column);
      }
    }
  }

  // Declares that the constraints are linear and the objective is quadratic.
  void declare_constant() { constant_ = true; }
  int jacobian_calls() const { return jacobian_calls_; }
  int hessian_calls() const { return hessian_calls_; }

  const Bounds& variable_bounds() const override { return variables_; }
  const Bounds& constraint_bounds() const override { return constraints_; }
  const std::vector<double>& start() const override { return start_; }
  bool linear_constraints() const override { return constant_; }
  bool quadratic_objective() const override { return constant_; }
  double objective(std::span<const double> x) const override { return functions_.f(x); }
  void gradient(std::span<const double> x, std::span<double> gradient) const override {
    functions_.gradient(x, gradient);
  }
  void constraints(std::span<const double> x, std::span<double> g) const override {
    if (!g.empty()) {
      functions_.g(x, g);
    }
  }
  const Sparsity& jacobian_sparsity() const override { return jacobian_; }
  void jacobian(std::span<const double> x, std::span<double> values) const override {
    ++jacobian_calls_;
    if (!values.empty()) {
      functions_.jacobian(x, values);
    }
  }
  const Sparsity& hessian_sparsity() const override { return hessian_; }
  void hessian(std::span<const double> x, double sigma, std::span<const double> lambda,
               std::span<double> values) const override {
    ++hessian_calls_;
    functions_.hessian(x, sigma, lambda, values);
  }
  std::string variable_name(int index) const override { return fmt::format("x{}", index + 1); }
  std::string constraint_name(int index) const override {
    return fmt::format("constraint {}", static_cast<char>('A' + index));
  }

 private:
  Bounds variables_;
  Bounds constraints_;
  std::vector<double> start_;
  Functions functions_;
  Sparsity jacobian_;
  Sparsity hessian_;
  bool constant_ = false;
  mutable int jacobian_calls_ = 0;
  mutable int hessian_calls_ = 0;
};

Bounds free_bounds(std::size_t n) {
  return {std::vector<double>(n, -kNoBound), std::vector<double>(n, kNoBound)};
}

void set(std::span<double> into, std::initializer_list<double> values) {
  ASSERT_EQ(into.size(), values.size());
  std::ranges::copy(values, into.begin());
}

// min (1 − x)² + 100 (y − x²)², least at (1, 1).
SmallProblem rosenbrock() {
  Functions functions;
  functions.f = [](auto x) {
    return std::pow(1.0 - x[0], 2) + 100.0 * std::pow(x[1] - x[0] * x[0], 2);
  };
  functions.gradient = [](auto x, auto out) {
    const double valley = x[1] - x[0] * x[0];
    set(out, {-2.0 * (1.0 - x[0]) - 400.0 * x[0] * valley, 200.0 * valley});
  };
  functions.hessian = [](auto x, double sigma, auto, auto out) {
    set(out, {sigma * (2.0 - 400.0 * x[1] + 1200.0 * x[0] * x[0]), sigma * -400.0 * x[0],
              sigma * 200.0});
  };
  return {free_bounds(2), {}, {-1.2, 1.0}, functions};
}

// Hock & Schittkowski, Test Examples for Nonlinear Programming Codes (1981), problem 71:
// min x₁x₄(x₁+x₂+x₃) + x₃,  x₁x₂x₃x₄ ≥ 25,  Σx² = 40,  1 ≤ x ≤ 5.
Functions hs071_functions() {
  Functions functions;
  functions.f = [](auto x) { return x[0] * x[3] * (x[0] + x[1] + x[2]) + x[2]; };
  functions.gradient = [](auto x, auto out) {
    set(out, {x[3] * (2.0 * x[0] + x[1] + x[2]), x[0] * x[3], x[0] * x[3] + 1.0,
              x[0] * (x[0] + x[1] + x[2])});
  };
  functions.g = [](auto x, auto out) {
    set(out, {x[0] * x[1] * x[2] * x[3], x[0] * x[0] + x[1] * x[1] + x[2] * x[2] + x[3] * x[3]});
  };
  functions.jacobian = [](auto x, auto out) {
    set(out, {x[1] * x[2] * x[3], x[0] * x[2] * x[3], x[0] * x[1] * x[3], x[0] * x[1] * x[2],
              2.0 * x[0], 2.0 * x[1], 2.0 * x[2], 2.0 * x[3]});
  };
  functions.hessian = [](auto x, double s, auto l, auto out) {
    const double two = 2.0 * l[1];
    set(out, {s * 2.0 * x[3] + two,                                    //
              s * x[3] + l[0] * x[2] * x[3], two,                      //
              s * x[3] + l[0] * x[1] * x[3], l[0] * x[0] * x[3], two,  //
              s * (2.0 * x[0] + x[1] + x[2]) + l[0] * x[1] * x[2],     //
              s * x[0] + l[0] * x[0] * x[2], s * x[0] + l[0] * x[0] * x[1], two});
  };
  return functions;
}

const Bounds kHs071Constraints{{25.0, 40.0}, {kNoBound, 40.0}};
constexpr double kHs071Optimum = 17.0140173;

SmallProblem hs071() {
  return {{{1.0, 1.0, 1.0, 1.0}, {5.0, 5.0, 5.0, 5.0}},
          kHs071Constraints,
          {1.0, 5.0, 5.0, 1.0},
          hs071_functions()};
}

// min ½ Σ d_i (x_i − t_i)²  with Σ x_i = sum if asked for.
SmallProblem separable(std::vector<double> d, std::vector<double> target, Bounds bounds,
                       std::vector<double> sum = {}) {
  Functions functions;
  functions.f = [d, target](auto x) {
    double value = 0.0;
    for (std::size_t i = 0; i < d.size(); ++i) {
      value += 0.5 * d[i] * std::pow(x[i] - target[i], 2);
    }
    return value;
  };
  functions.gradient = [d, target](auto x, auto out) {
    for (std::size_t i = 0; i < d.size(); ++i) {
      out[i] = d[i] * (x[i] - target[i]);
    }
  };
  functions.g = [](auto x, auto out) { out[0] = std::accumulate(x.begin(), x.end(), 0.0); };
  functions.jacobian = [](auto, auto out) { std::ranges::fill(out, 1.0); };
  functions.hessian = [d](auto, double sigma, auto, auto out) {
    std::ranges::fill(out, 0.0);
    for (std::size_t i = 0; i < d.size(); ++i) {
      out[i * (i + 3) / 2] = sigma * d[i];
    }
  };
  std::vector<double> start(d.size(), 0.0);
  return {std::move(bounds), {sum, sum}, std::move(start), functions};
}

Solution solve_or_fail(const Problem& problem, SolverOptions options = {}) {
  Result<Solution> solution = solve(problem, options);
  EXPECT_TRUE(solution.has_value()) << to_string(solution.error());
  return solution.value_or(Solution{});
}

TEST(Ipopt, FindsTheBottomOfRosenbrocksValleyWithoutConstraints) {
  const Solution solution = solve_or_fail(rosenbrock());
  ASSERT_EQ(solution.outcome, Outcome::solved) << solution.message;
  ASSERT_EQ(solution.x.size(), 2U);
  EXPECT_NEAR(solution.x[0], 1.0, 1e-6);
  EXPECT_NEAR(solution.x[1], 1.0, 1e-6);
  EXPECT_NEAR(solution.objective, 0.0, 1e-12);
  EXPECT_TRUE(solution.lambda.empty());
  EXPECT_GT(solution.iterations, 5);
  EXPECT_TRUE(solution.message.empty());
}

TEST(Ipopt, SolvesHockAndSchittkowskis71) {
  const Solution solution = solve_or_fail(hs071());
  ASSERT_EQ(solution.outcome, Outcome::solved) << solution.message;
  EXPECT_NEAR(solution.objective, kHs071Optimum, 1e-6);
  const std::vector<double> published = {1.0, 4.7429994, 3.8211503, 1.3794082};
  ASSERT_EQ(solution.x.size(), published.size());
  for (std::size_t i = 0; i < published.size(); ++i) {
    EXPECT_NEAR(solution.x[i], published[i], 1e-5) << i;
  }
}

TEST(Ipopt, KeepsAFixedVariableExactly) {
  // The free optimum has x₁ = 1; x₁ = 1.2 costs more.
  for (const double fixed : {1.0, 1.2}) {
    const SmallProblem problem({{fixed, 1.0, 1.0, 1.0}, {fixed, 5.0, 5.0, 5.0}}, kHs071Constraints,
                               {3.0, 4.0, 4.0, 2.0}, hs071_functions());
    const Solution solution = solve_or_fail(problem);
    ASSERT_EQ(solution.outcome, Outcome::solved) << solution.message;
    ASSERT_EQ(solution.x.size(), 4U);
    EXPECT_EQ(solution.x[0], fixed);
    if (fixed == 1.0) {
      EXPECT_NEAR(solution.objective, kHs071Optimum, 1e-6);
    } else {
      EXPECT_GT(solution.objective, kHs071Optimum + 0.1);
    }
  }
}

TEST(Ipopt, ProjectsOntoABox) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform(-3.0, 3.0);
  constexpr std::size_t kN = 30;
  std::vector<double> d(kN);
  std::vector<double> target(kN);
  for (std::size_t i = 0; i < kN; ++i) {
    d[i] = std::exp(uniform(random));
    target[i] = uniform(random);
  }
  const SmallProblem problem =
      separable(d, target, {std::vector<double>(kN, -1.0), std::vector<double>(kN, 0.5)});
  const Solution solution = solve_or_fail(problem);
  ASSERT_EQ(solution.outcome, Outcome::solved) << solution.message;
  ASSERT_EQ(solution.x.size(), kN);
  for (std::size_t i = 0; i < kN; ++i) {
    EXPECT_NEAR(solution.x[i], std::clamp(target[i], -1.0, 0.5), 1e-5) << i;
  }
}

TEST(Ipopt, GivesMultipliersWithWhichTheLagrangianIsStationary) {
  // min ½ Σ d (x − t)², Σx = s: d (x − t) + λ = 0, so λ = (Σt − s) / Σ1/d.
  const SmallProblem problem = separable({1.0, 2.0, 4.0}, {1.0, 2.0, 3.0}, free_bounds(3), {2.5});
  const Solution solution = solve_or_fail(problem);
  ASSERT_EQ(solution.outcome, Outcome::solved) << solution.message;
  ASSERT_EQ(solution.lambda.size(), 1U);
  const double lambda = (6.0 - 2.5) / 1.75;
  EXPECT_NEAR(solution.lambda[0], lambda, 1e-6);
  EXPECT_NEAR(solution.x[0], 1.0 - lambda, 1e-6);
  EXPECT_NEAR(solution.x[1], 2.0 - lambda / 2.0, 1e-6);
  EXPECT_NEAR(solution.x[2], 3.0 - lambda / 4.0, 1e-6);
}

TEST(Ipopt, EvaluatesConstantDerivativesOnce) {
  const auto calls = [](bool declared) {
    SmallProblem problem =
        separable({1.0, 2.0, 4.0}, {1.0, 2.0, 3.0},
                  {std::vector<double>(3, -1.0), std::vector<double>(3, 1.0)}, {0.5});
    if (declared) {
      problem.declare_constant();
    }
    EXPECT_EQ(solve_or_fail(problem).outcome, Outcome::solved);
    return std::pair(problem.jacobian_calls(), problem.hessian_calls());
  };
  EXPECT_EQ(calls(true), std::pair(1, 1));
  EXPECT_GT(calls(false).second, 3);
}

TEST(Ipopt, NamesTheWorstConstraintOfAnInfeasibleProblem) {
  // A: x + y = 3 against the box [−1, 1]²; the least violation is 1.
  const SmallProblem problem = separable({1.0, 1.0}, {0.0, 0.0}, {{-1.0, -1.0}, {1.0, 1.0}}, {3.0});
  const Solution solution = solve_or_fail(problem);
  EXPECT_EQ(solution.outcome, Outcome::not_converged);
  EXPECT_THAT(solution.message, HasSubstr("worst violation 1 in constraint A"));
}

TEST(Ipopt, StopsAtTheIterationLimit) {
  SolverOptions options;
  options.max_iterations = 3;
  const Solution solution = solve_or_fail(rosenbrock(), options);
  EXPECT_EQ(solution.outcome, Outcome::not_converged);
  EXPECT_EQ(solution.iterations, 3);
  EXPECT_THAT(solution.message, StartsWith("ipopt status"));
  EXPECT_EQ(solution.x.size(), 2U);
}

TEST(Ipopt, DoesNotConvergeOnMoreEquationsThanUnknowns) {
  Functions functions = hs071_functions();
  functions.g = [](auto x, auto out) { set(out, {x[0], x[1], x[0] + x[1]}); };
  functions.jacobian = [](auto, auto out) { set(out, {1.0, 0.0, 0.0, 1.0, 1.0, 1.0}); };
  functions.f = [](auto) { return 0.0; };
  functions.gradient = [](auto, auto out) { set(out, {0.0, 0.0}); };
  functions.hessian = [](auto, double, auto, auto out) { set(out, {0.0, 0.0, 0.0}); };
  const std::vector<double> sides = {1.0, 1.0, 3.0};
  const Solution solution =
      solve_or_fail(SmallProblem(free_bounds(2), {sides, sides}, {0.0, 0.0}, functions));
  EXPECT_EQ(solution.outcome, Outcome::not_converged);
  EXPECT_THAT(solution.message, HasSubstr("status"));
}

TEST(Ipopt, DoesNotConvergeOnAnObjectiveThatIsNoNumber) {
  Functions functions;
  functions.f = [](auto) { return std::numeric_limits<double>::quiet_NaN(); };
  functions.gradient = [](auto, auto out) { set(out, {1.0, 1.0}); };
  functions.hessian = [](auto, double, auto, auto out) { set(out, {1.0, 0.0, 1.0}); };
  const Solution solution = solve_or_fail(SmallProblem(free_bounds(2), {}, {0.0, 0.0}, functions));
  EXPECT_EQ(solution.outcome, Outcome::not_converged);
  EXPECT_FALSE(solution.message.empty());
}

TEST(Ipopt, BacksOffWhereTheObjectiveIsNoNumber) {
  // min x − ln x from x = 5: the full Newton step leads to x < 0.
  Functions functions;
  functions.f = [](auto x) { return x[0] - std::log(x[0]); };
  functions.gradient = [](auto x, auto out) { out[0] = 1.0 - 1.0 / x[0]; };
  functions.hessian = [](auto x, double sigma, auto, auto out) { out[0] = sigma / (x[0] * x[0]); };
  const Solution solution = solve_or_fail(SmallProblem(free_bounds(1), {}, {5.0}, functions));
  ASSERT_EQ(solution.outcome, Outcome::solved) << solution.message;
  EXPECT_NEAR(solution.x.at(0), 1.0, 1e-6);
}

TEST(Ipopt, GivesTheSameBytesAgain) {
  const Solution first = solve_or_fail(hs071());
  solve_or_fail(rosenbrock());
  const Solution again = solve_or_fail(hs071());
  EXPECT_EQ(first.x, again.x);
  EXPECT_EQ(first.lambda, again.lambda);
  EXPECT_EQ(first.objective, again.objective);
  EXPECT_EQ(first.iterations, again.iterations);
}

TEST(Ipopt, NamesTheOptionItRefuses) {
  SolverOptions options;
  options.tolerance = -1.0;
  const Result<Solution> solution = solve(rosenbrock(), options);
  ASSERT_FALSE(solution);
  EXPECT_EQ(solution.error().kind, ErrorKind::internal);
  EXPECT_EQ(solution.error().message, "ipopt refuses the option 'tol'");
}

TEST(Ipopt, PrintsNothing) {
  ::testing::internal::CaptureStdout();
  ::testing::internal::CaptureStderr();
  solve_or_fail(hs071());
  EXPECT_EQ(::testing::internal::GetCapturedStdout(), "");
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

TEST(Ipopt, TellsItsVersion) { EXPECT_THAT(solver_version(), StartsWith("ipopt 3.")); }

}  // namespace
}  // namespace unflex::nlp
