// Compares the banded engine's two forms with each other and with Ipopt on the same program.
#include "banded_engine.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "limits.hpp"
#include "window_makers.hpp"

namespace unflex::compensate {
namespace {

using testing::largest;
using testing::largest_difference;
using testing::random_path;
using testing::solve_by_ipopt;
using testing::WindowKind;

// The required agreement: 0.05 µm, and a millionth of the objective. Ipopt needs a tight tolerance,
// or its own error would be measured.
constexpr double kSameBaseMm = 5e-5;
constexpr double kSameObjective = 1e-6;
constexpr double kIpoptTolerance = 1e-12;
// Below this objective, mm²·s, a window is tracked more exactly than the output's grid.
constexpr double kIdle = 1e-16;

AxisSolution solve(const AxisWindow& window, BandedForm form = BandedForm::fitting) {
  const Result<AxisSolution> solution = make_banded_engine(form)->solve(window);
  EXPECT_TRUE(solution.has_value()) << to_string(solution.error());
  return solution.value_or(AxisSolution{});
}

TEST(BandedEngine, RefusesAWindowThatHoldsNoNumbers) {
  std::mt19937_64 random(3);
  AxisWindow window = random_path(random, 40, {});
  window.weight.assign(window.weight.size(), std::numeric_limits<double>::quiet_NaN());
  for (const BandedForm form : {BandedForm::flat, BandedForm::stages}) {
    const Result<AxisSolution> solution = make_banded_engine(form)->solve(window);
    ASSERT_FALSE(solution.has_value());
    EXPECT_EQ(solution.error().message,
              "the window's program cannot be solved even without limits");
  }
}

void expect_same(const AxisSolution& a, const AxisSolution& b, double base_mm, double objective) {
  EXPECT_LE(largest_difference(a.base.position_mm, b.base.position_mm), base_mm);
  EXPECT_NEAR(a.objective, b.objective, objective * b.objective + kIdle);
}

// A limit, set on windows that it constrains.
struct Limit {
  const char* name;
  std::function<void(AxisWindow&)> set;
  ActiveLimits active;
};

void limit_travel(AxisWindow& window) {
  const auto [low, high] = std::ranges::minmax(window.reference_mm);
  window.limits.min_position_mm = low;
  window.limits.max_position_mm = high;
}

const std::vector<Limit> kLimits = {
    {"none", [](AxisWindow&) {}, {}},
    {"accel", [](AxisWindow& w) { w.limits.max_accel_mm_s2 = 6e3; }, {.accel = true}},
    {"tight_accel", [](AxisWindow& w) { w.limits.max_accel_mm_s2 = 4e3; }, {.accel = true}},
    {"velocity",
     [](AxisWindow& w) {
       w.limits.max_velocity_mm_s = 70.0;
       w.limits.max_accel_mm_s2 = 2e4;
     },
     {.velocity = true}},
    {"jerk", [](AxisWindow& w) { w.limits.max_jerk_mm_s3 = 2e6; }, {.jerk = true}},
    {"position", limit_travel, {.position = true}},
    {"accel_and_travel_between_nodes",
     [](AxisWindow& w) {
       limit_travel(w);
       w.limits.max_accel_mm_s2 = 6e3;
     },
     {.accel = true, .position = true, .position_between = true}},
    {"all",
     [](AxisWindow& w) {
       limit_travel(w);
       w.limits.max_velocity_mm_s = 90.0;
       w.limits.max_accel_mm_s2 = 6e3;
       w.limits.max_jerk_mm_s3 = 3e6;
     },
     {true, true, true, true, true}},
};

// Solves the window by Ipopt and in each form. Expects all to find the same, be it that there is no
// solution. Returns how many forms found one.
int solved_as_by_ipopt(const AxisWindow& window, const std::vector<BandedForm>& forms) {
  const Result<AxisSolution> ipopt = solve_within_limits(window, [&](const ActiveLimits& active) {
    return solve_by_ipopt(window, active, kIpoptTolerance);
  });
  int solved = 0;
  for (const BandedForm form : forms) {
    const Result<AxisSolution> solution = make_banded_engine(form)->solve(window);
    EXPECT_EQ(solution.has_value(), ipopt.has_value());
    if (solution && ipopt) {
      ++solved;
      expect_same(*solution, *ipopt, kSameBaseMm, kSameObjective);
    }
  }
  return solved;
}

class BandedEngineUnder : public ::testing::TestWithParam<Limit> {};

TEST_P(BandedEngineUnder, FindsIpoptsOptimum) {
  std::mt19937_64 random(7);
  int solved = 0;
  for (int trial = 0; trial < 8; ++trial) {
    const WindowKind kind{.start = trial % 2 == 0, .end = trial % 4 < 2};
    AxisWindow window = random_path(random, 60 + 60 * static_cast<std::size_t>(trial), kind);
    GetParam().set(window);
    SCOPED_TRACE(std::string(GetParam().name) + ", window " + std::to_string(trial));
    solved += solved_as_by_ipopt(window, {BandedForm::fitting, BandedForm::stages});
  }
  EXPECT_GE(solved, 8);
}

TEST_P(BandedEngineUnder, FindsIpoptsOptimumForAnAxisThatMayBeSeveralThings) {
  std::mt19937_64 random(8);
  int solved = 0;
  for (int trial = 0; trial < 6; ++trial) {
    const WindowKind kind{.start = trial % 2 == 0, .end = trial % 4 < 2};
    AxisWindow window = random_path(random, 60 + 40 * static_cast<std::size_t>(trial), kind);
    GetParam().set(window);
    window.plants = {{{1.1 * kind.omega_rad_s, kind.zeta}, 0.3},
                     {{0.9 * kind.omega_rad_s, kind.zeta}, 0.4}};
    if (trial % 3 == 0) {
      window.plants.push_back({{0.9 * kind.omega_rad_s, 0.5 * kind.zeta}, 0.1});
      window.plants.push_back({{1.1 * kind.omega_rad_s, 1.5 * kind.zeta}, 0.05});
    }
    if (trial % 2 == 1) {
      // Each model has an aim of its own.
      for (std::size_t i = 0; i < window.models(); ++i) {
        window.aims_mm.push_back(window.reference_mm);
        for (double& aim_mm : window.aims_mm.back()) {
          aim_mm += 0.01 * static_cast<double>(i);
        }
      }
    }
    SCOPED_TRACE(std::string(GetParam().name) + ", window " + std::to_string(trial));
    solved += solved_as_by_ipopt(window, {BandedForm::fitting});
  }
  EXPECT_GE(solved, 4);
}

// Axes of two and three modes, with gains of either sign, and such axes that may be several things.
TEST_P(BandedEngineUnder, FindsIpoptsOptimumForAxesOfSeveralModes) {
  using dynamics::FlexibleAxis;
  using dynamics::Mode;
  const std::array two = {Mode{282.7, 0.06, 0.8}, Mode{691.2, 0.06, 0.2}};
  const std::array opposed = {Mode{282.7, 0.06, 1.2}, Mode{691.2, 0.1, -0.2}};
  const std::array three = {Mode{285.3, 0.071, 0.36}, Mode{365.1, 0.085, 0.37},
                            Mode{206.1, 0.152, 0.27}};
  const std::vector<FlexibleAxis> axes = {FlexibleAxis(two), FlexibleAxis(opposed),
                                          FlexibleAxis(three)};
  std::mt19937_64 random(9);
  int solved = 0;
  for (std::size_t trial = 0; trial < 9; ++trial) {
    const WindowKind kind{
        .period_s = trial % 2 == 0 ? 1e-3 : 5e-4, .start = trial % 2 == 0, .end = trial % 4 < 2};
    AxisWindow window = random_path(random, 60 + 40 * trial, kind);
    GetParam().set(window);
    window.axis = axes[trial % 3];
    if (window.start) {
      // Each mode swings.
      window.start->nozzle = window.axis.riding(window.start->base_mm);
      for (dynamics::NozzleMotion& part : window.start->nozzle.parts) {
        part.velocity += part.position != 0.0 ? 0.5 : 0.0;
      }
    }
    if (trial >= 6) {
      window.plants = {{window.axis.detuned(1.1), 0.3}, {axes[0].detuned(0.9), 0.2}};
    }
    SCOPED_TRACE(std::string(GetParam().name) + ", window " + std::to_string(trial));
    solved += solved_as_by_ipopt(window, {BandedForm::fitting});
  }
  EXPECT_GE(solved, 5);
}

TEST_P(BandedEngineUnder, FindsTheSameOptimumByBothForms) {
  std::mt19937_64 random(8);
  int held = 0;
  int without = 0;
  for (int trial = 0; trial < 40; ++trial) {
    const WindowKind kind{.omega_rad_s = 200.0 + 10.0 * trial,
                          .zeta = trial % 5 == 0 ? 0.0 : 0.02 * trial,
                          .start = trial % 3 != 0,
                          .end = trial % 2 == 0};
    AxisWindow window = random_path(random, 8 + 12 * static_cast<std::size_t>(trial), kind);
    GetParam().set(window);
    SCOPED_TRACE(std::string(GetParam().name) + ", window " + std::to_string(trial));
    const Result<AxisSolution> by_stages = make_banded_engine(BandedForm::stages)->solve(window);
    const Result<AxisSolution> flat = make_banded_engine(BandedForm::flat)->solve(window);
    if (!by_stages || !flat) {
      // The flat form may lack precision, but it must not find a solution that does not exist.
      EXPECT_FALSE(flat.has_value());
      ++without;
      continue;
    }
    expect_same(*flat, *by_stages, 2e-5, 2e-8);
    if (std::isfinite(window.limits.max_accel_mm_s2)) {
      EXPECT_EQ(broken(flat->base, window.limits, window.period_s), ActiveLimits{});
    }
    held += flat->iterations > 1 ? 1 : 0;
  }
  EXPECT_LE(without, 20);
  EXPECT_EQ(held > 5, GetParam().active != ActiveLimits{}) << held << " windows held by the limit";
}

INSTANTIATE_TEST_SUITE_P(Limits, BandedEngineUnder, ::testing::ValuesIn(kLimits),
                         [](const auto& limit) { return std::string(limit.param.name); });

TEST(BandedEngine, TakesAnyResonanceDampingAndPeriod) {
  std::mt19937_64 random(9);
  for (const double omega_h : {0.0126, 0.03, 0.06, 0.2, 1.0, 2.0}) {
    for (const double zeta : {0.0, 0.06, 0.5, 1.0, 2.0}) {
      const double period_s = omega_h < 0.05 ? 1e-4 : 1e-3;
      const WindowKind kind{.omega_rad_s = omega_h / period_s, .zeta = zeta, .period_s = period_s};
      AxisWindow window = random_path(random, 300, kind);
      window.limits.max_accel_mm_s2 = 2e4;
      SCOPED_TRACE("omega h " + std::to_string(omega_h) + ", zeta " + std::to_string(zeta));
      const AxisSolution solution = solve(window);
      EXPECT_LE(largest(solution.base.accel_mm_s2), 2e4 * (1.0 + 2e-6));
      const Result<AxisSolution> ipopt =
          solve_within_limits(window, [&](const ActiveLimits& active) {
            return solve_by_ipopt(window, active, kIpoptTolerance);
          });
      if (ipopt) {
        expect_same(solution, *ipopt, kSameBaseMm, kSameObjective);
      }
    }
  }
}

TEST(BandedEngine, TakesVariantsThatAreTheAxisItselfForOneThing) {
  std::mt19937_64 random(12);
  for (const std::size_t plants : {2U, 4U}) {
    AxisWindow window = random_path(random, 200, {});
    const AxisSolution alone = solve(window);
    window.plants.assign(plants, {window.axis, 0.2});
    expect_same(solve(window), alone, 1e-9, 1e-9);
  }
}

TEST(BandedEngine, TakesTheShortestWindows) {
  std::mt19937_64 random(10);
  for (std::size_t nodes = 2; nodes <= 10; ++nodes) {
    // Leave out two nodes free at both ends: they have more unknowns than terms in the cost.
    for (int ends = nodes == 2 ? 1 : 0; ends < 4; ++ends) {
      AxisWindow window = random_path(random, nodes, {.start = ends % 2 == 1, .end = ends >= 2});
      SCOPED_TRACE(std::to_string(nodes) + " nodes, ends " + std::to_string(ends));
      const Result<AxisSolution> ipopt = solve_by_ipopt(window, {}, kIpoptTolerance);
      ASSERT_TRUE(ipopt.has_value()) << to_string(ipopt.error());
      expect_same(solve(window), *ipopt, kSameBaseMm, kSameObjective);
    }
  }
}

TEST(BandedEngine, MovesWithinASingleInterval) {
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

TEST(BandedEngine, FollowsAReferenceThatTheBaseCanMake) {
  // r = 5 mm + sin⁴ over 0.2 s, undamped: b = r + r̈/ω².
  AxisWindow window;
  window.axis = {100.0, 0.0};
  window.jerk_weight = 1e-6;
  const double rate = std::numbers::pi / 0.2;
  const auto r = [&](double t) { return 5.0 + std::pow(std::sin(rate * t), 4); };
  for (int i = 0; i <= 400; ++i) {
    window.reference_mm.push_back(r(0.5e-3 * i));
    window.weight.push_back(1.0);
  }
  const AxisSolution solution = solve(window);
  EXPECT_EQ(solution.iterations, 1);
  for (int k = 20; k <= 180; ++k) {
    const double t = 1e-3 * k;
    const double s2 = std::pow(std::sin(rate * t), 2);
    const double r_ddot = rate * rate * s2 * (12.0 - 16.0 * s2);
    ASSERT_NEAR(solution.base.position_mm[static_cast<std::size_t>(k)], r(t) + r_ddot / 1e4, 1e-4);
  }
}

TEST(BandedEngine, KeepsItsEndsToTheBit) {
  std::mt19937_64 random(11);
  for (const BandedForm form : {BandedForm::flat, BandedForm::stages}) {
    const AxisWindow window = random_path(random, 300, {});
    const AxisSolution solution = solve(window, form);
    EXPECT_EQ(solution.base.position_mm.front(), window.start->base_mm);
    EXPECT_EQ(solution.base.velocity_mm_s.front(), 0.0);
    EXPECT_EQ(solution.base.position_mm.back(), *window.end_base_mm);
    EXPECT_EQ(solution.base.velocity_mm_s.back(), 0.0);
  }
}

TEST(BandedEngine, LetsABaseAtTheEndOfItsTravelSetOffInwardsOnly) {
  // The nozzle starts beyond the base, which rests at the end of the travel and may not follow it.
  std::mt19937_64 random(12);
  for (const BandedForm form : {BandedForm::flat, BandedForm::stages}) {
    AxisWindow window = random_path(random, 200, {});
    window.limits.max_accel_mm_s2 = 2e4;
    limit_travel(window);
    window.limits.min_position_mm = window.start->base_mm;
    window.start->nozzle = {window.start->base_mm - 0.1, 0.0};
    for (double& r : window.reference_mm) {
      r = std::max(r, window.start->base_mm);
    }
    window.end_base_mm = window.reference_mm.back();
    const AxisSolution solution = solve(window, form);
    EXPECT_GE(solution.base.accel_mm_s2.front(), -1e-3);
    EXPECT_EQ(broken(solution.base, window.limits, window.period_s), ActiveLimits{});
  }
}

TEST(BandedEngine, SaysWhichLimitMakesAWindowImpossible) {
  // 10 mm in 20 ms at no more than 100 mm/s.
  AxisWindow window;
  window.reference_mm.assign(41, 0.0);
  window.weight.assign(41, 1.0);
  window.limits.max_velocity_mm_s = 100.0;
  window.limits.max_accel_mm_s2 = 1e5;
  window.start = AxisWindow::Start{};
  window.end_base_mm = 10.0;
  for (const BandedForm form : {BandedForm::fitting, BandedForm::flat, BandedForm::stages}) {
    const auto solution = make_banded_engine(form)->solve(window);
    ASSERT_FALSE(solution.has_value());
    EXPECT_EQ(solution.error().kind, ErrorKind::internal);
    EXPECT_THAT(solution.error().message, ::testing::HasSubstr("worst violation"));
  }
  // With more time the move is possible.
  window.reference_mm.assign(501, 0.0);
  window.weight.assign(501, 1.0);
  EXPECT_TRUE(make_banded_engine()->solve(window).has_value());
}

TEST(BandedEngine, GivesTheSameBytesInEveryThread) {
  std::mt19937_64 random(13);
  std::vector<AxisWindow> windows;
  for (std::size_t i = 0; i < 30; ++i) {
    windows.push_back(random_path(random, 20 + 37 * i, {.start = i % 2 == 0, .end = i % 3 == 0}));
    kLimits[i % kLimits.size()].set(windows.back());
  }
  const auto engine = make_banded_engine();
  std::vector<AxisSolution> expected;
  for (const AxisWindow& window : windows) {
    expected.push_back(engine->solve(window).value_or(AxisSolution{}));
  }
  constexpr std::size_t kThreads = 8;
  std::vector<std::vector<AxisSolution>> found(kThreads);
  std::vector<std::thread> threads;
  for (std::size_t t = 0; t < kThreads; ++t) {
    threads.emplace_back([&, t] {
      found[t].resize(windows.size());
      for (std::size_t i = 0; i < windows.size(); ++i) {
        // Each thread solves in another order, so that anything left over from the previous window
        // would show.
        const std::size_t at = (i * 7 + t * 11) % windows.size();
        found[t][at] = engine->solve(windows[at]).value_or(AxisSolution{});
      }
    });
  }
  for (std::thread& thread : threads) {
    thread.join();
  }
  for (const auto& solutions : found) {
    for (std::size_t i = 0; i < windows.size(); ++i) {
      EXPECT_EQ(solutions[i].base.position_mm, expected[i].base.position_mm) << i;
      EXPECT_EQ(solutions[i].base.accel_mm_s2, expected[i].base.accel_mm_s2) << i;
      EXPECT_EQ(solutions[i].objective, expected[i].objective) << i;
    }
  }
}

TEST(BandedEngine, IsNamed) { EXPECT_EQ(make_banded_engine()->name(), "banded"); }

}  // namespace
}  // namespace unflex::compensate
