// The Ipopt engine on single windows: whether it finds the optimum, and the same one every time.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "playback.hpp"

namespace unflex::compensate {
namespace {

using testing::planner_limits;
using testing::replayed_objective;
using testing::setup_for;
using testing::x_window;

AxisSolution solve(const AxisWindow& window) {
  const Result<AxisSolution> solution = make_ipopt_engine()->solve(window);
  EXPECT_TRUE(solution.has_value()) << to_string(solution.error());
  return solution.value_or(AxisSolution{});
}

// A path out and back with various corners, partly travel.
AxisWindow zigzag(const dynamics::FlexibleAxis& axis, double base_accel) {
  const auto moves = testing::plan(
      {{20.0, 20.0}, {26.0, 20.0}, {25.0, 24.0}, {21.0, 22.0, false}, {20.5, 22.0}, {30.0, 22.5}},
      planner_limits(100.0, 5000.0, 5.0));
  return x_window(moves, setup_for(axis, base_accel));
}

// The base's motion, changed by ε times a cubic B-spline at every node where `shape` is not zero:
// its acceleration stays linear between nodes.
dynamics::AxisTrajectory perturbed(const dynamics::AxisTrajectory& base,
                                   const std::vector<double>& shape, double h) {
  dynamics::AxisTrajectory result = base;
  for (std::size_t k = 1; k + 1 < shape.size(); ++k) {
    const double before = shape[k - 1];
    const double after = shape[k + 1];
    result.position_mm[k] += (before + 4.0 * shape[k] + after) / 6.0;
    result.velocity_mm_s[k] += (after - before) / (2.0 * h);
    result.accel_mm_s2[k] += (before - 2.0 * shape[k] + after) / (h * h);
  }
  return result;
}

double largest(const std::vector<double>& values) {
  return std::abs(*std::ranges::max_element(values, {}, [](double v) { return std::abs(v); }));
}

TEST(IpoptEngine, FollowsAReferenceThatTheBaseCanMake) {
  // r = 5 mm + 1 mm · sin² over 0.2 s is smooth, so the nozzle is on it throughout, and the base is
  // where the inverse model puts it.
  const dynamics::FlexibleAxis axis{100.0, 0.0};
  AxisWindow window;
  window.axis = axis;
  window.jerk_weight = 1e-6;
  const double rate = std::numbers::pi / 0.2;
  const auto r = [&](double t) { return 5.0 + std::pow(std::sin(rate * t), 4); };
  for (int i = 0; i <= 400; ++i) {
    window.reference_mm.push_back(r(0.5e-3 * i));
    window.weight.push_back(1.0);
  }
  const AxisSolution solution = solve(window);
  ASSERT_EQ(solution.base.position_mm.size(), 201U);
  // Undamped: b = r + r̈/ω².
  double worst = 0.0;
  for (int k = 20; k <= 180; ++k) {
    const double t = 1e-3 * k;
    const double s2 = std::pow(std::sin(rate * t), 2);
    const double r_ddot = rate * rate * s2 * (12.0 - 16.0 * s2);
    worst = std::max(worst, std::abs(solution.base.position_mm[static_cast<std::size_t>(k)] -
                                     (r(t) + r_ddot / 1e4)));
  }
  EXPECT_LT(worst, 1e-4);
}

TEST(IpoptEngine, ReportsTheObjectiveThatTheReplayedNozzleHas) {
  for (const dynamics::FlexibleAxis& axis :
       {dynamics::FlexibleAxis{}, dynamics::FlexibleAxis{100.0, 0.5}}) {
    const AxisWindow window = zigzag(axis, 2e4);
    const AxisSolution solution = solve(window);
    const double replayed = replayed_objective(window, solution.base, window.start->nozzle);
    EXPECT_NEAR(replayed, solution.objective, 1e-3 * solution.objective);
    EXPECT_GT(solution.iterations, 0);
  }
}

TEST(IpoptEngine, LeavesNothingToGainWithinTheLimits) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  // With the first limit the optimum keeps the limit by itself, with the second the limit is
  // active.
  for (const double limit : {1e6, 1.2e4}) {
    const AxisWindow window = zigzag({}, limit);
    const double h = window.period_s;
    const AxisSolution solution = solve(window);
    const double optimum = replayed_objective(window, solution.base, window.start->nozzle);
    EXPECT_EQ(largest(solution.base.accel_mm_s2) > limit * (1.0 - 1e-6), limit < 1e5);
    int feasible = 0;
    for (int trial = 0; trial < 2000 && feasible < 200; ++trial) {
      // Bumps of up to 12 nodes, anywhere but at the ends, of 0.03 to 3 µm.
      std::vector<double> shape(window.nodes(), 0.0);
      const auto width = 1 + static_cast<std::size_t>(trial) % 12;
      const auto at = static_cast<std::size_t>(
          2.0 + 0.5 * (1.0 + uniform(random)) * static_cast<double>(window.nodes() - width - 5));
      const double size = 3e-3 * std::pow(10.0, -1.0 + uniform(random));
      for (std::size_t i = 0; i < width; ++i) {
        shape[at + i] = size * uniform(random);
      }
      const dynamics::AxisTrajectory other = perturbed(solution.base, shape, h);
      if (largest(other.accel_mm_s2) > limit * (1.0 + 1e-9)) {
        continue;
      }
      ++feasible;
      EXPECT_GT(replayed_objective(window, other, window.start->nozzle), optimum * (1.0 - 1e-5))
          << "bump of " << width << " nodes at " << at << " of " << size << " mm";
    }
    EXPECT_EQ(feasible, 200);
  }
}

TEST(IpoptEngine, IsAsGoodWithLimitsThatDoNotMatter) {
  AxisWindow window = zigzag({}, 1e9);
  window.limits = {};
  const AxisSolution free = solve(window);
  window.limits = {1e4, 1e6, 1e10, -1000.0, 1000.0};
  const AxisSolution limited = solve(window);
  EXPECT_EQ(free.base.position_mm, limited.base.position_mm);
  EXPECT_EQ(free.base.accel_mm_s2, limited.base.accel_mm_s2);
  EXPECT_EQ(free.iterations, limited.iterations);
}

TEST(IpoptEngine, GivesTheSameBytesAgain) {
  const AxisWindow window = zigzag({}, 1.2e4);
  const auto engine = make_ipopt_engine();
  const auto first = engine->solve(window);
  ASSERT_TRUE(engine->solve(zigzag({100.0, 0.5}, 1e6)).has_value());
  const auto again = engine->solve(window);
  ASSERT_TRUE(first.has_value() && again.has_value());
  EXPECT_EQ(first->base.position_mm, again->base.position_mm);
  EXPECT_EQ(first->base.velocity_mm_s, again->base.velocity_mm_s);
  EXPECT_EQ(first->base.accel_mm_s2, again->base.accel_mm_s2);
  EXPECT_EQ(first->objective, again->objective);
  EXPECT_EQ(first->iterations, again->iterations);
}

TEST(IpoptEngine, DoesNotDependOnWhereOnTheBedItIs) {
  AxisWindow window = zigzag({}, 1.2e4);
  const AxisSolution here = solve(window);
  constexpr double kOff = 128.0;
  for (double& r : window.reference_mm) {
    r += kOff;
  }
  window.start->base_mm += kOff;
  window.start->nozzle.add(window.axis.riding(kOff));
  *window.end_base_mm += kOff;
  const AxisSolution there = solve(window);
  for (std::size_t k = 0; k < window.nodes(); ++k) {
    ASSERT_NEAR(here.base.position_mm[k] + kOff, there.base.position_mm[k], 1e-7) << k;
  }
}

TEST(IpoptEngine, StartsAndEndsTheBaseAtRest) {
  const AxisWindow window = zigzag({}, 2e4);
  const AxisSolution solution = solve(window);
  EXPECT_NEAR(solution.base.position_mm.front(), 20.0, 1e-12);
  EXPECT_EQ(solution.base.velocity_mm_s.front(), 0.0);
  EXPECT_NEAR(solution.base.position_mm.back(), 30.0, 1e-12);
  EXPECT_EQ(solution.base.velocity_mm_s.back(), 0.0);
}

TEST(IpoptEngine, QuietensANozzleThatStillSwings) {
  // An earlier motion has left a swing of 50 µm and 10 mm/s. The reference rests for 60 ms.
  AxisWindow window;
  window.period_s = 1e-3;
  window.reference_mm.assign(121, 50.0);
  window.weight.assign(121, 1.0);
  window.limits.max_accel_mm_s2 = 2e4;
  window.start = AxisWindow::Start{{50.05, 10.0}, 50.0};
  window.end_base_mm = 50.0;
  const AxisSolution solution = solve(window);
  const auto nozzle =
      testing::play(window.axis, solution.base, window.period_s, window.start->nozzle);
  EXPECT_NEAR(nozzle.back().position(), 50.0, 1e-5);
  EXPECT_NEAR(nozzle.back().velocity(), 0.0, 1e-2);
  // Without the base's motion the nozzle would swing on for long.
  dynamics::NozzleState alone =
      dynamics::exact_step(window.axis, window.start->nozzle, {50.0, 0.0, 0.0}, 0.06);
  EXPECT_GT(std::hypot(alone.position() - 50.0, alone.velocity() / window.axis.main().omega_rad_s),
            5e-3);
}

TEST(IpoptEngine, SaysWhichLimitMakesAWindowImpossible) {
  // 10 mm in 20 ms at no more than 100 mm/s.
  AxisWindow window;
  window.reference_mm.assign(41, 0.0);
  window.weight.assign(41, 1.0);
  window.limits.max_velocity_mm_s = 100.0;
  window.limits.max_accel_mm_s2 = 1e5;
  window.start = AxisWindow::Start{};
  window.end_base_mm = 10.0;
  const auto solution = make_ipopt_engine()->solve(window);
  ASSERT_FALSE(solution.has_value());
  EXPECT_EQ(solution.error().kind, ErrorKind::internal);
  EXPECT_THAT(solution.error().message, ::testing::HasSubstr("defect of base"));
}

TEST(IpoptEngine, MovesWithinASingleInterval) {
  // Rest to rest over Δ in one interval: the cubic 3s² − 2s³, with b̈ = ±6Δ/h² at its ends.
  AxisWindow window;
  window.reference_mm.assign(3, 0.0);
  window.weight.assign(3, 1.0);
  window.start = AxisWindow::Start{};
  window.end_base_mm = 1e-3;
  const AxisSolution solution = solve(window);
  ASSERT_EQ(solution.base.accel_mm_s2.size(), 2U);
  EXPECT_NEAR(solution.base.accel_mm_s2[0], 6000.0, 1e-6);
  EXPECT_NEAR(solution.base.accel_mm_s2[1], -6000.0, 1e-6);
}

TEST(IpoptEngine, IsNamedAfterItsSolver) {
  EXPECT_THAT(make_ipopt_engine()->name(), ::testing::StartsWith("ipopt 3."));
}

}  // namespace
}  // namespace unflex::compensate
