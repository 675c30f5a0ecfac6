#include "axis_problem.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "collocation/derivative_check.hpp"
#include "playback.hpp"
#include "unflex/collocation/hargraves_paris.hpp"
#include "unflex/nlp/ipopt_solver.hpp"

namespace unflex::compensate {
namespace {

using collocation::PointVector;
using nlp::testing::expect_exact_derivatives;
using nlp::testing::expect_sound_patterns;
using nlp::testing::random_vector;

constexpr ActiveLimits kAllActive{true, true, true, true, true};

AxisWindow random_window(std::mt19937_64& random, std::size_t nodes) {
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  AxisWindow window;
  window.axis = {50.0 + 400.0 * uniform(random), 1.2 * uniform(random)};
  window.period_s = 1e-4 + 2e-3 * uniform(random);
  for (std::size_t i = 0; i < 2 * nodes - 1; ++i) {
    window.reference_mm.push_back(100.0 + uniform(random));
    window.weight.push_back(uniform(random) < 0.5 ? 0.1 : 1.0);
  }
  window.jerk_weight = 1e-2 + uniform(random);
  window.limits = {200.0, 2e4, 1e7, 90.0, 110.0};
  return window;
}

// Every other window has an aim of its own for each model.
void give_aims(std::mt19937_64& random, AxisWindow& window, int trial) {
  std::uniform_real_distribution<double> uniform(-0.1, 0.1);
  for (std::size_t i = 0; trial % 2 == 1 && i < window.models(); ++i) {
    window.aims_mm.push_back(window.reference_mm);
    for (double& aim_mm : window.aims_mm.back()) {
      aim_mm += uniform(random);
    }
  }
}

std::vector<double> node_times(std::size_t nodes) {
  std::vector<double> times(nodes);
  for (std::size_t k = 0; k < nodes; ++k) {
    times[k] = static_cast<double>(k);
  }
  return times;
}

TEST(AxisProblem, HasExactDerivatives) {
  std::mt19937_64 random(1);
  for (int trial = 0; trial < 20; ++trial) {
    AxisWindow window = random_window(random, 2 + static_cast<std::size_t>(trial) % 6);
    window.plants.assign(trial % 3 == 0 ? 0 : (trial % 3 == 1 ? 2 : 4), {{200.0, 0.1}, 0.2});
    give_aims(random, window, trial);
    for (const ActiveLimits active : {ActiveLimits{}, kAllActive}) {
      const AxisProblem problem(window, active);
      const auto program = collocation::transcribe(problem, node_times(window.nodes()));
      const auto x = random_vector(random, program->start().size(), 2.0);
      const auto lambda = random_vector(random, program->constraint_bounds().lower.size(), 2.0);
      // Everything is quadratic at most, so a wide step costs no accuracy.
      expect_exact_derivatives(*program, x, 0.7, lambda, 1e-9, 0.1);
      expect_sound_patterns(*program);
    }
  }
}

TEST(AxisProblem, IsTheOscillatorOnItsBase) {
  // p̈ = 2ζω(ḃ − ṗ) + ω²(b − p), in mm and s, against the scaled right-hand side.
  std::mt19937_64 random(2);
  for (int trial = 0; trial < 100; ++trial) {
    const AxisWindow window = random_window(random, 3);
    const AxisProblem problem(window, {});
    const auto physical = random_vector(random, 5, 50.0);
    PointVector z(5);
    for (int i = 0; i < 5; ++i) {
      const auto component = static_cast<AxisProblem::Component>(i);
      z(i) = problem.to_scaled(component, physical[static_cast<std::size_t>(i)]);
      EXPECT_NEAR(problem.to_physical(component, z(i)), physical[static_cast<std::size_t>(i)],
                  1e-10);
    }
    collocation::StateVector f(4);
    problem.dynamics(0.0, z, f);
    const double omega = window.axis.main().omega_rad_s;
    const double accel = 2.0 * window.axis.main().zeta * omega * (physical[3] - physical[1]) +
                         omega * omega * (physical[2] - physical[0]);
    const double h = window.period_s;
    const double scale = kLengthUnitMm / h;
    EXPECT_NEAR(f(AxisProblem::kNozzle) * scale, physical[1], 1e-9);
    EXPECT_NEAR(f(AxisProblem::kNozzleRate) * scale / h, accel, 1e-9 * std::abs(accel));
    EXPECT_NEAR(f(AxisProblem::kBase) * scale, physical[3], 1e-9);
    EXPECT_NEAR(f(AxisProblem::kBaseRate) * scale / h, physical[4], 1e-9);
  }
}

TEST(AxisProblem, TakesReferenceAndWeightAtNodesAndMiddles) {
  std::mt19937_64 random(3);
  const AxisWindow window = random_window(random, 5);
  const AxisProblem problem(window, {});
  PointVector z = PointVector::Zero(5);
  for (std::size_t i = 0; i < 9; ++i) {
    const double t = 0.5 * static_cast<double>(i);
    z(AxisProblem::kNozzle) = problem.to_scaled(AxisProblem::kNozzle, window.reference_mm[i]);
    EXPECT_NEAR(problem.cost(t, z), 0.0, 1e-20);
    z(AxisProblem::kNozzle) =
        problem.to_scaled(AxisProblem::kNozzle, window.reference_mm[i] + 0.03);
    EXPECT_NEAR(problem.cost(t, z), 9.0 * window.weight[i], 1e-9);
  }
}

TEST(AxisProblem, FixesTheEndsAsGiven) {
  std::mt19937_64 random(4);
  AxisWindow window = random_window(random, 5);
  window.start = AxisWindow::Start{{100.25, -3.0}, 100.5};
  window.end_base_mm = 100.75;
  const AxisProblem problem(window, {});
  PointVector lower(5);
  PointVector upper(5);
  const auto fixed_at = [&](AxisProblem::Component component, double physical) {
    EXPECT_EQ(lower(component), upper(component));
    EXPECT_NEAR(problem.to_physical(component, lower(component)), physical, 1e-12);
  };
  problem.node_bounds(0, 5, lower, upper);
  fixed_at(AxisProblem::kNozzle, 100.25);
  fixed_at(AxisProblem::kNozzleRate, -3.0);
  fixed_at(AxisProblem::kBase, 100.5);
  fixed_at(AxisProblem::kBaseRate, 0.0);
  EXPECT_LE(lower(AxisProblem::kBaseAccel), -nlp::kNoBound);
  problem.node_bounds(2, 5, lower, upper);
  EXPECT_LE(lower.maxCoeff(), -nlp::kNoBound);
  EXPECT_GE(upper.minCoeff(), nlp::kNoBound);
  problem.node_bounds(4, 5, lower, upper);
  fixed_at(AxisProblem::kBase, 100.75);
  fixed_at(AxisProblem::kBaseRate, 0.0);
  EXPECT_LE(lower(AxisProblem::kNozzle), -nlp::kNoBound);
  EXPECT_LE(lower(AxisProblem::kNozzleRate), -nlp::kNoBound);
}

TEST(AxisProblem, CarriesOnlyTheLimitsThatAreActive) {
  std::mt19937_64 random(5);
  const AxisWindow window = random_window(random, 5);
  const double h = window.period_s;
  PointVector lower(5);
  PointVector upper(5);
  const auto bounds = [&](ActiveLimits active, AxisProblem::Component component) {
    const AxisProblem problem(window, active);
    problem.node_bounds(1, 5, lower, upper);
    return std::pair(problem.to_physical(component, lower(component)),
                     problem.to_physical(component, upper(component)));
  };
  const auto velocity = bounds({.velocity = true}, AxisProblem::kBaseRate);
  EXPECT_NEAR(velocity.second, 200.0 - 2e4 * h / 4.0, 1e-9);
  EXPECT_NEAR(velocity.first, -velocity.second, 1e-9);
  EXPECT_GE(upper(AxisProblem::kBaseAccel), nlp::kNoBound);
  const auto accel = bounds({.accel = true}, AxisProblem::kBaseAccel);
  EXPECT_NEAR(accel.second, 2e4, 1e-6);
  EXPECT_NEAR(accel.first, -2e4, 1e-6);
  EXPECT_GE(upper(AxisProblem::kBaseRate), nlp::kNoBound);
  const auto position = bounds({.position = true}, AxisProblem::kBase);
  EXPECT_NEAR(position.first, 90.0, 1e-12);
  EXPECT_NEAR(position.second, 110.0, 1e-12);
  const auto between = bounds({.position = true, .position_between = true}, AxisProblem::kBase);
  EXPECT_NEAR(between.first, 90.0 + 2e4 * h * h / 8.0, 1e-12);
  EXPECT_NEAR(between.second, 110.0 - 2e4 * h * h / 8.0, 1e-12);
  EXPECT_GE(AxisProblem(window, {}).slope_limit()(0), nlp::kNoBound);
  EXPECT_NEAR(AxisProblem(window, {.jerk = true}).slope_limit()(0) * kLengthUnitMm / (h * h * h),
              1e7, 1e-3);
}

TEST(AxisProblem, LetsABaseAtTheEndOfItsTravelSetOffInwardsOnly) {
  std::mt19937_64 random(6);
  AxisWindow window = random_window(random, 5);
  window.start = AxisWindow::Start{{90.0, 0.0}, 90.0};
  window.end_base_mm = 110.0;
  PointVector lower(5);
  PointVector upper(5);
  const AxisProblem problem(window, {.position = true, .position_between = true});
  problem.node_bounds(0, 5, lower, upper);
  EXPECT_EQ(lower(AxisProblem::kBaseAccel), 0.0);
  EXPECT_GE(upper(AxisProblem::kBaseAccel), nlp::kNoBound);
  EXPECT_NEAR(problem.to_physical(AxisProblem::kBase, lower(AxisProblem::kBase)), 90.0, 1e-12);
  problem.node_bounds(4, 5, lower, upper);
  EXPECT_EQ(upper(AxisProblem::kBaseAccel), 0.0);
  EXPECT_LE(lower(AxisProblem::kBaseAccel), -nlp::kNoBound);
}

TEST(AxisProblem, ItsSolutionIsWhatTheNozzleDoes) {
  // Compares the nozzle's states in the program with the exact response to the base's motion.
  const auto moves = testing::plan({{0.0, 0.0}, {10.0, 0.0}, {4.0, 3.0}, {4.0, 9.0}},
                                   testing::planner_limits(100.0, 5000.0, 5.0));
  for (const dynamics::FlexibleAxis& axis :
       {dynamics::FlexibleAxis{}, dynamics::FlexibleAxis{100.0, 0.5}}) {
    const AxisWindow window = testing::x_window(moves, testing::setup_for(axis, 2e4));
    const AxisProblem problem(window, {.accel = true});
    const auto program = collocation::transcribe(problem, node_times(window.nodes()));
    const auto solution = nlp::solve(*program, {});
    ASSERT_TRUE(solution.has_value());
    ASSERT_EQ(solution->outcome, nlp::Outcome::solved) << solution->message;
    dynamics::AxisTrajectory base;
    std::vector<dynamics::NozzleState> nozzle;
    for (std::size_t k = 0; k < window.nodes(); ++k) {
      const PointVector z = collocation::node(problem, solution->x, static_cast<int>(k));
      const auto at = [&](AxisProblem::Component c) { return problem.to_physical(c, z(c)); };
      base.position_mm.push_back(at(AxisProblem::kBase));
      base.velocity_mm_s.push_back(at(AxisProblem::kBaseRate));
      base.accel_mm_s2.push_back(at(AxisProblem::kBaseAccel));
      nozzle.push_back({at(AxisProblem::kNozzle), at(AxisProblem::kNozzleRate)});
    }
    const auto played = testing::play(axis, base, window.period_s, nozzle.front());
    double worst_mm = 0.0;
    double worst_mm_s = 0.0;
    for (std::size_t k = 0; k < window.nodes(); ++k) {
      const dynamics::NozzleState& exact = played[k * testing::kSubsteps];
      worst_mm = std::max(worst_mm, std::abs(nozzle[k].position() - exact.position()));
      worst_mm_s = std::max(worst_mm_s, std::abs(nozzle[k].velocity() - exact.velocity()));
    }
    EXPECT_LT(worst_mm, 1e-5);
    EXPECT_LT(worst_mm_s, 1e-2);
  }
}

}  // namespace
}  // namespace unflex::compensate
