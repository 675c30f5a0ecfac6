// Motors that move both axes keep their limits, and that costs little accuracy.
#include "shared_motors.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <random>
#include <string>
#include <vector>

#include "window_makers.hpp"

namespace unflex::compensate {
namespace {

RunWindow random_window(std::mt19937_64& random, double max_accel_mm_s2, double max_velocity_mm_s) {
  RunWindow window{testing::random_path(random, 240, {}), testing::random_path(random, 240, {}),
                   true};
  for (AxisWindow* const axis : {&window.x, &window.y}) {
    axis->limits.max_accel_mm_s2 = max_accel_mm_s2;
    axis->limits.max_velocity_mm_s = max_velocity_mm_s;
  }
  return window;
}

double cost(const AxisSolutions& solutions) {
  return solutions[0]->objective + solutions[1]->objective;
}

double largest_sum(const std::vector<double>& x, const std::vector<double>& y) {
  double largest = 0.0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    largest = std::max(largest, std::abs(x[k]) + std::abs(y[k]));
  }
  return largest;
}

// Solves with half of the limits for each axis all the time.
AxisSolutions halved(const Engine& engine, RunWindow window) {
  for (AxisWindow* const axis : {&window.x, &window.y}) {
    axis->limits.max_accel_mm_s2 /= 2.0;
    axis->limits.max_velocity_mm_s /= 2.0;
  }
  return {engine.solve(window.x), engine.solve(window.y)};
}

TEST(SharedMotors, KeepTheirLimitsAndCostLessThanHalvedOnes) {
  std::mt19937_64 random(23);
  const auto engine = make_banded_engine();
  int divided = 0;
  for (int trial = 0; trial < 30; ++trial) {
    SCOPED_TRACE("window " + std::to_string(trial));
    const double accel = trial % 2 == 0 ? 11000.0 : 18000.0;
    const double velocity = trial % 3 == 0 ? 230.0 : 600.0;
    RunWindow window = random_window(random, accel, velocity);
    const RunWindow asked = window;
    const AxisSolutions alone = {engine->solve(window.x), engine->solve(window.y)};
    const AxisSolutions solutions = solve_with_shared_motors(*engine, window);
    const AxisSolutions half = halved(*engine, asked);
    if (!alone[0] || !alone[1] || !half[0] || !half[1]) {
      continue;
    }
    ASSERT_TRUE(solutions[0] && solutions[1]);
    const dynamics::AxisTrajectory& x = solutions[0]->base;
    const dynamics::AxisTrajectory& y = solutions[1]->base;
    EXPECT_LE(largest_sum(x.accel_mm_s2, y.accel_mm_s2), accel * (1.0 + 1e-5));
    EXPECT_LE(largest_sum(x.velocity_mm_s, y.velocity_mm_s), velocity * (1.0 + 1e-5));
    EXPECT_GE(cost(solutions), (1.0 - 1e-6) * cost(alone));
    EXPECT_LE(cost(solutions), (1.0 + 1e-6) * cost(half));
    divided += window.x.max_accel_at_mm_s2.empty() ? 0 : 1;
    // The limits that the window got are all that each axis has to know.
    EXPECT_LT(testing::largest_difference(engine->solve(window.x)->base.position_mm, x.position_mm),
              1e-9);
  }
  EXPECT_GE(divided, 10);
}

TEST(SharedMotors, WithEnoughRoomChangeNothing) {
  std::mt19937_64 random(24);
  const auto engine = make_banded_engine();
  RunWindow window = random_window(random, 80000.0, 2000.0);
  const AxisSolutions alone = {engine->solve(window.x), engine->solve(window.y)};
  const AxisSolutions solutions = solve_with_shared_motors(*engine, window);
  EXPECT_EQ(solutions[0]->base.position_mm, alone[0]->base.position_mm);
  EXPECT_EQ(solutions[1]->base.position_mm, alone[1]->base.position_mm);
  EXPECT_TRUE(window.x.max_accel_at_mm_s2.empty());
}

TEST(LimitsAtTheNodes, AreKeptByBothEngines) {
  std::mt19937_64 random(25);
  AxisWindow window = testing::random_path(random, 120, {});
  window.limits.max_accel_mm_s2 = 20000.0;
  for (std::size_t k = 0; k < window.nodes(); ++k) {
    window.max_accel_at_mm_s2.push_back(12000.0 + 5000.0 * std::sin(0.3 * static_cast<double>(k)));
  }
  const Result<AxisSolution> banded = make_banded_engine()->solve(window);
  const Result<AxisSolution> ipopt = make_ipopt_engine()->solve(window);
  ASSERT_TRUE(banded && ipopt);
  bool reached = false;
  for (std::size_t k = 0; k < window.nodes(); ++k) {
    const double share = std::abs(banded->base.accel_mm_s2[k]) / window.max_accel_at_mm_s2[k];
    EXPECT_LE(share, 1.0 + 2e-6) << k;
    reached = reached || share > 0.999;
  }
  EXPECT_TRUE(reached);
  EXPECT_LT(testing::largest_difference(banded->base.position_mm, ipopt->base.position_mm), 2e-4);
}

}  // namespace
}  // namespace unflex::compensate
