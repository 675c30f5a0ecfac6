// Whole problems with known optima, transcribed and solved.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "test_problems.hpp"
#include "unflex/collocation/hargraves_paris.hpp"
#include "unflex/nlp/ipopt_solver.hpp"

namespace unflex::collocation {
namespace {

using testing::LinearQuadratic;

std::vector<double> even_mesh(double to, int intervals) {
  std::vector<double> times;
  for (int k = 0; k <= intervals; ++k) {
    times.push_back(to * k / intervals);
  }
  return times;
}

nlp::Solution solve(const OptimalControlProblem& problem, const std::vector<double>& times) {
  nlp::SolverOptions options;
  options.tolerance = 1e-11;
  const auto program = transcribe(problem, times);
  Result<nlp::Solution> solution = nlp::solve(*program, options);
  EXPECT_TRUE(solution.has_value());
  EXPECT_EQ(solution->outcome, nlp::Outcome::solved) << solution->message;
  return solution.value_or(nlp::Solution{});
}

// Largest error of one component against its known course, over the nodes.
template <class Course>
double worst_error(const OptimalControlProblem& problem, const std::vector<double>& times,
                   const nlp::Solution& solution, int component, const Course& course) {
  double worst = 0.0;
  for (std::size_t k = 0; k < times.size(); ++k) {
    const PointVector z = node(problem, solution.x, static_cast<int>(k));
    worst = std::max(worst, std::abs(z(component) - course(times[k])));
  }
  return worst;
}

// b̈ = u with cost u².
class DoubleIntegrator final : public LinearQuadratic {
 public:
  DoubleIntegrator() {
    a = Eigen::MatrixXd::Zero(2, 2);
    a(0, 1) = 1.0;
    b = Eigen::MatrixXd::Zero(2, 1);
    b(1, 0) = 1.0;
    q = Eigen::MatrixXd::Zero(3, 3);
    q(2, 2) = 1.0;
  }
};

TEST(Convergence, IsExactWhereTheOptimumIsACubic) {
  // From rest at 0 to rest at 1 in 1 s with least ∫u²: x = 3t² − 2t³, u = 6 − 12t, ∫u² = 12.
  DoubleIntegrator problem;
  problem.first = {{0, 0.0}, {1, 0.0}};
  problem.last = {{0, 1.0}, {1, 0.0}};
  for (const std::vector<double>& times :
       {even_mesh(1.0, 2), even_mesh(1.0, 9), {0.0, 0.1, 0.15, 0.6, 0.61, 1.0}}) {
    const nlp::Solution solution = solve(problem, times);
    EXPECT_NEAR(solution.objective, 12.0, 1e-8);
    EXPECT_LT(
        worst_error(problem, times, solution, 0, [](double t) { return t * t * (3.0 - 2.0 * t); }),
        1e-9);
    EXPECT_LT(worst_error(problem, times, solution, 2, [](double t) { return 6.0 - 12.0 * t; }),
              1e-8);
  }
}

TEST(Convergence, IsOfFourthOrderInTheDynamicsAlone) {
  // ẍ = −x − 0.4ẋ + sin 3t, no cost: the states follow from the beginning alone. The exact
  // solution is a decaying oscillation and the forced one.
  LinearQuadratic problem;
  problem.a = (Eigen::MatrixXd(2, 2) << 0.0, 1.0, -1.0, -0.4).finished();
  problem.b = Eigen::MatrixXd::Zero(2, 0);
  problem.q = Eigen::MatrixXd::Zero(2, 2);
  problem.drift = [](double t) { return Eigen::Vector2d(0.0, std::sin(3.0 * t)); };
  // x_p = α sin 3t + β cos 3t with −9α + α − 1.2β = 1 and −9β + β + 1.2α = 0.
  const double beta = -1.2 / (64.0 + 1.44);
  const double alpha = -8.0 / (64.0 + 1.44);
  const double wd = std::sqrt(0.96);
  const auto exact = [&](double t) {
    const double c = 1.0 - beta;  // x(0) = 1, ẋ(0) = 0
    const double s = (0.2 * c - 3.0 * alpha) / wd;
    return std::exp(-0.2 * t) * (c * std::cos(wd * t) + s * std::sin(wd * t)) +
           alpha * std::sin(3.0 * t) + beta * std::cos(3.0 * t);
  };
  problem.first = {{0, 1.0}, {1, 0.0}};
  const auto error = [&](int intervals) {
    const std::vector<double> times = even_mesh(4.0, intervals);
    return worst_error(problem, times, solve(problem, times), 0, exact);
  };
  const double coarse = error(20);
  const double middle = error(40);
  const double fine = error(80);
  EXPECT_LT(coarse, 1e-3);
  EXPECT_NEAR(std::log2(coarse / middle), 4.0, 0.1);
  EXPECT_NEAR(std::log2(middle / fine), 4.0, 0.1);
}

TEST(Convergence, IsOfFourthOrderInTheStatesAndTheCostOfAnOptimum) {
  // min ½∫₀² (x² + u²), ẋ = u, x(0) = 1: x = cosh(2−t)/cosh 2, u = −sinh(2−t)/cosh 2,
  // cost ½ tanh 2. The control, linear between nodes, converges with the second order.
  LinearQuadratic problem;
  problem.a = Eigen::MatrixXd::Zero(1, 1);
  problem.b = Eigen::MatrixXd::Ones(1, 1);
  problem.q = 0.5 * Eigen::MatrixXd::Identity(2, 2);
  problem.first = {{0, 1.0}};
  struct Errors {
    double state;
    double control;
    double cost;
  };
  const auto errors = [&](int intervals) {
    const std::vector<double> times = even_mesh(2.0, intervals);
    const nlp::Solution solution = solve(problem, times);
    return Errors{worst_error(problem, times, solution, 0,
                              [](double t) { return std::cosh(2.0 - t) / std::cosh(2.0); }),
                  worst_error(problem, times, solution, 1,
                              [](double t) { return -std::sinh(2.0 - t) / std::cosh(2.0); }),
                  std::abs(solution.objective - 0.5 * std::tanh(2.0))};
  };
  const Errors coarse = errors(10);
  const Errors middle = errors(20);
  const Errors fine = errors(40);
  EXPECT_LT(fine.state, 1e-7);
  for (const auto& [a, b] : {std::pair(coarse, middle), std::pair(middle, fine)}) {
    EXPECT_NEAR(std::log2(a.state / b.state), 4.0, 0.2);
    EXPECT_NEAR(std::log2(a.cost / b.cost), 4.0, 0.1);
    EXPECT_NEAR(std::log2(a.control / b.control), 2.0, 0.1);
  }
}

// A pendulum to be swung as x = sin t, with the torque that does so known:
//   ẍ = u − sin x,   min ∫ (x − sin t)² + (u − u*)²,   u* = sin(sin t) − sin t.
class SwungPendulum final : public LinearQuadratic {
 public:
  SwungPendulum() {
    a = Eigen::MatrixXd::Zero(2, 2);
    b = Eigen::MatrixXd::Zero(2, 1);
    q = Eigen::MatrixXd::Zero(3, 3);
    q(0, 0) = q(2, 2) = 1.0;
    target = [](double t) {
      return Eigen::Vector3d(std::sin(t), 0.0, std::sin(std::sin(t)) - std::sin(t));
    };
    first = {{0, 0.0}, {1, 1.0}};
  }
  void dynamics(double /*t*/, const PointVector& z, StateVector& f) const override {
    f(0) = z(1);
    f(1) = z(2) - std::sin(z(0));
  }
  void dynamics_jacobian(double /*t*/, const PointVector& z, StateByPoint& fz) const override {
    fz << 0.0, 1.0, 0.0, -std::cos(z(0)), 0.0, 1.0;
  }
  void dynamics_hessian(double /*t*/, const PointVector& z, const StateVector& mu,
                        PointByPoint& h) const override {
    h.setZero();
    h(0, 0) = mu(1) * std::sin(z(0));
  }
  StateByPointPattern dynamics_pattern() const override {
    return StateByPointPattern::Constant(2, 3, true);
  }
  bool linear_dynamics() const override { return false; }
};

TEST(Convergence, ReachesTheKnownOptimumOfANonlinearProblem) {
  const SwungPendulum problem;
  const auto error = [&](int intervals) {
    const std::vector<double> times = even_mesh(5.0, intervals);
    const nlp::Solution solution = solve(problem, times);
    EXPECT_LT(solution.objective, 1e-5);
    return worst_error(problem, times, solution, 0, [](double t) { return std::sin(t); });
  };
  const double coarse = error(20);
  const double middle = error(40);
  const double fine = error(80);
  EXPECT_LT(fine, 1e-7);
  EXPECT_NEAR(std::log2(coarse / middle), 4.0, 0.1);
  EXPECT_NEAR(std::log2(middle / fine), 4.0, 0.1);
}

TEST(Convergence, KeepsSlopesWithinTheirLimitAndUsesIt) {
  // Rest to rest as above, but the control starts and ends at zero.
  DoubleIntegrator problem;
  problem.first = {{0, 0.0}, {1, 0.0}, {2, 0.0}};
  problem.last = {{0, 1.0}, {1, 0.0}, {2, 0.0}};
  const std::vector<double> times = even_mesh(1.0, 40);
  const auto steepest = [&](const nlp::Solution& solution) {
    double worst = 0.0;
    for (int k = 0; k < 40; ++k) {
      worst = std::max(worst, 40.0 * std::abs(node(problem, solution.x, k + 1)(2) -
                                              node(problem, solution.x, k)(2)));
    }
    return worst;
  };
  const nlp::Solution free = solve(problem, times);
  EXPECT_GT(steepest(free), 100.0);
  double previous = free.objective;
  for (const double limit : {80.0, 50.0, 40.0}) {
    problem.limit_of_slope = limit;
    const nlp::Solution limited = solve(problem, times);
    EXPECT_LE(steepest(limited), limit * (1.0 + 1e-8));
    EXPECT_GE(steepest(limited), limit * (1.0 - 1e-6));
    EXPECT_GT(limited.objective, previous + 0.1);
    previous = limited.objective;
  }
  problem.limit_of_slope = 1e4;
  EXPECT_NEAR(solve(problem, times).objective, free.objective, 1e-7);
}

}  // namespace
}  // namespace unflex::collocation
