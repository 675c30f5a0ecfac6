#include "unflex/study/coarse_to_fine.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <optional>

#include "gauge.hpp"
#include "unflex/core/axes.hpp"
#include "unflex/rivals/axis_path.hpp"
#include "unflex_base.hpp"
#include "values_of.hpp"

namespace unflex::study {
namespace {

constexpr int kRepeats = 5;
// A solve is repeated for its timing until this much time is spent.
constexpr double kEnough_s = 0.02;
constexpr int kParts = 8;

struct Solved : Axes<compensate::AxisSolution> {
  double wall_s = 0.0;

  [[nodiscard]] int iterations() const {
    return sum_of_axes([](const compensate::AxisSolution& of) { return of.iterations; }, *this);
  }
};

// Solves several times to find the least time. Each solve gives the same result.
Result<Solved> solve(const compensate::RunWindow& window, const compensate::Engine& engine) {
  Solved solved;
  solved.wall_s = std::numeric_limits<double>::infinity();
  double spent_s = 0.0;
  for (int i = 0; i < kRepeats && spent_s < kEnough_s; ++i) {
    const auto start = std::chrono::steady_clock::now();
    Axes<Result<compensate::AxisSolution>> both =
        map_axes([&](const compensate::AxisWindow& of) { return engine.solve(of); }, window);
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
    Result<Axes<compensate::AxisSolution>> solutions = values_of(std::move(both));
    if (!solutions) {
      return tl::unexpected(solutions.error());
    }
    spent_s += took.count();
    solved = {std::move(*solutions), std::min(solved.wall_s, took.count())};
  }
  return solved;
}

// The coarse base at the fine nodes, and the nozzle on it.
compensate::AxisWindow::Guess refine(const dynamics::AxisTrajectory& coarse, double coarse_s,
                                     const compensate::AxisWindow& fine) {
  compensate::AxisWindow::Guess guess;
  const std::size_t last = coarse.position_mm.size() - 2;
  for (std::size_t k = 0; k < fine.nodes(); ++k) {
    const double t = static_cast<double>(k) * fine.period_s;
    const std::size_t from = std::min(static_cast<std::size_t>(t / coarse_s + 1e-9), last);
    const double s = std::min(t - static_cast<double>(from) * coarse_s, coarse_s);
    const dynamics::AxisMotion base = dynamics::between(coarse, from, s, coarse_s);
    guess.base.position_mm.push_back(base.position_mm);
    guess.base.velocity_mm_s.push_back(base.velocity_mm_s);
    guess.base.accel_mm_s2.push_back(base.accel_mm_s2);
  }
  guess.nozzle = rivals::nozzle_on(fine.axis, rivals::through_nodes(coarse, 0.0, coarse_s, kParts),
                                   {0.0, fine.period_s, fine.nodes()});
  return guess;
}

compensate::RunWindow window_of(const Run& run, const BenchSetup& bench, double multiple,
                                double period_s) {
  compensate::Setup setup = bench.unflex;
  setup.period_s = period_s;
  limit_accel(setup, multiple * bench.plan_accel_mm_s2);
  const std::size_t nodes = compensate::node_grid(run.plan, setup).count;
  return compensate::windows(run.plan, {{0, nodes - 1, 0, nodes - 1}},
                             at_rest(setup, run.plan.front().segment.start_mm), setup)
      .front();
}

double difference_mm(const dynamics::AxisTrajectory& a, const dynamics::AxisTrajectory& b) {
  double most = 0.0;
  for (std::size_t k = 0; k < a.position_mm.size(); ++k) {
    most = std::max(most, std::abs(a.position_mm[k] - b.position_mm[k]));
  }
  return most;
}

}  // namespace

Result<std::vector<ChainStep>> coarse_to_fine(const Run& run, const BenchSetup& setup,
                                              double multiple, const compensate::Engine& engine) {
  std::vector<ChainStep> chain;
  std::optional<Solved> coarse;
  for (const double period_s : kChainPeriods_s) {
    compensate::RunWindow window = window_of(run, setup, multiple, period_s);
    const Result<Solved> cold = solve(window, engine);
    if (!cold) {
      return tl::unexpected(cold.error());
    }
    ChainStep step{.period_s = period_s,
                   .nodes = window.x.nodes(),
                   .cold_iterations = cold->iterations(),
                   .warm_iterations = cold->iterations(),
                   .cold_s = cold->wall_s,
                   .warm_s = cold->wall_s};
    if (coarse) {
      for_each_axis(
          [&](compensate::AxisWindow& fine, const compensate::AxisSolution& of) {
            fine.guess = refine(of.base, chain.back().period_s, fine);
          },
          window, *coarse);
      const Result<Solved> warm = solve(window, engine);
      if (!warm) {
        return tl::unexpected(warm.error());
      }
      step.warm_iterations = warm->iterations();
      step.warm_s = warm->wall_s;
      step.difference_mm = most_of_axes(
          [](const compensate::AxisSolution& a, const compensate::AxisSolution& b) {
            return difference_mm(a.base, b.base);
          },
          *warm, *cold);
    }
    const BaseMotion base{map_axes(
        [&](const compensate::AxisSolution& of) {
          return rivals::through_nodes(of.base, -setup.unflex.lead_in_s, period_s, kParts);
        },
        *cold)};
    step.contour_max_mm = straying(base, run.plan, setup, 0.0).max_mm;
    chain.push_back(step);
    coarse = *cold;
  }
  return chain;
}

}  // namespace unflex::study
