// Windows that have a first guess.
#include <gtest/gtest.h>

#include <random>

#include "axis_problem.hpp"
#include "window_makers.hpp"

namespace unflex::compensate {
namespace {

// A window without a guess, whose base is held by its limit of acceleration.
AxisWindow limited_window() {
  std::mt19937_64 random(7);
  AxisWindow window = testing::random_path(random, 150, {});
  const AxisSolution free = make_banded_engine()->solve(window).value();
  window.limits.max_accel_mm_s2 = 0.6 * testing::largest(free.base.accel_mm_s2);
  return window;
}

// The window's own solution as a guess, with the nozzle's response to it.
AxisWindow::Guess guess_from(const AxisWindow& window, const AxisSolution& solution) {
  AxisWindow::Guess guess{{window.start->nozzle}, solution.base};
  for (std::size_t k = 0; k + 1 < window.nodes(); ++k) {
    dynamics::NozzleState nozzle = guess.nozzle.back();
    const double step_s = window.period_s / 10;
    for (int i = 0; i < 10; ++i) {
      const auto from = dynamics::between(solution.base, k, i * step_s, window.period_s);
      const auto middle = dynamics::between(solution.base, k, (i + 0.5) * step_s, window.period_s);
      nozzle = dynamics::exact_step(
          window.axis, nozzle, {from.position_mm, from.velocity_mm_s, middle.accel_mm_s2}, step_s);
    }
    guess.nozzle.push_back(nozzle);
  }
  return guess;
}

TEST(Guess, IsWhereTheProgramStarts) {
  AxisWindow window = limited_window();
  const AxisSolution solution = make_banded_engine()->solve(window).value();
  window.guess = guess_from(window, solution);
  const AxisProblem problem(window, {});
  collocation::PointVector z(5);
  problem.guess(17, 17.0, z);
  EXPECT_NEAR(problem.to_physical(AxisProblem::kNozzle, z(AxisProblem::kNozzle)),
              window.guess->nozzle[17].position(), 1e-12);
  EXPECT_NEAR(problem.to_physical(AxisProblem::kBase, z(AxisProblem::kBase)),
              solution.base.position_mm[17], 1e-12);
  EXPECT_NEAR(problem.to_physical(AxisProblem::kBaseAccel, z(AxisProblem::kBaseAccel)),
              solution.base.accel_mm_s2[17], 1e-8);
}

TEST(Guess, SavesIpoptIterationsAndDoesNotMoveItsSolution) {
  const auto engine = make_ipopt_engine();
  AxisWindow window = limited_window();
  const AxisSolution cold = engine->solve(window).value();
  ASSERT_GT(cold.iterations, 10) << "the limit is not active";
  window.guess = guess_from(window, cold);
  const AxisSolution warm = engine->solve(window).value();
  EXPECT_LT(warm.iterations, 0.8 * cold.iterations);
  EXPECT_LT(testing::largest_difference(warm.base.position_mm, cold.base.position_mm), 1e-4);
  EXPECT_NEAR(warm.objective, cold.objective, 1e-5 * cold.objective);
}

TEST(Guess, IsNothingToTheBandedEngine) {
  const auto engine = make_banded_engine();
  AxisWindow window = limited_window();
  const AxisSolution cold = engine->solve(window).value();
  window.guess = guess_from(window, cold);
  const AxisSolution again = engine->solve(window).value();
  EXPECT_EQ(again.iterations, cold.iterations);
  EXPECT_EQ(again.base.position_mm, cold.base.position_mm);
}

}  // namespace
}  // namespace unflex::compensate
