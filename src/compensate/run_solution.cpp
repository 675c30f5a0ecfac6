#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "blend.hpp"
#include "contour.hpp"
#include "limits.hpp"
#include "mode_motors.hpp"
#include "shared_motors.hpp"
#include "unflex/compensate/run.hpp"

namespace unflex::compensate {

AxisSolution along(const AxisWindow& window) {
  const std::size_t nodes = window.nodes();
  const double duration_s = static_cast<double>(nodes - 1) * window.period_s;
  AxisSolution solution;
  for (std::size_t k = 0; k < nodes; ++k) {
    solution.base.position_mm.push_back(window.reference_mm[2 * k]);
  }
  solution.base.velocity_mm_s.assign(
      nodes, (window.reference_mm.back() - window.reference_mm.front()) / duration_s);
  solution.base.accel_mm_s2.assign(nodes, 0.0);
  return solution;
}

void prepare(const Engine& divider, const WindowSpan& span, RunWindow& window) {
  if (span.cruise) {
    return;
  }
  if (window.contour) {
    static_cast<void>(aim(window));
  }
  if (window.shares_motors) {
    // The solution is dropped. Only the limits that it has set in the window count.
    static_cast<void>(solve_with_shared_motors(divider, window));
  }
}

AxisSolutions solve(const Engine& engine, const WindowSpan& span, RunWindow& window) {
  if (span.cruise) {
    const auto cruise = [](const AxisWindow& axis) { return Result<AxisSolution>(along(axis)); };
    AxisSolutions solutions{map_axes(cruise, window)};
    if (window.third) {
      solutions.third = cruise(*window.third);
    }
    return solutions;
  }
  if (window.third) {
    return solve_modes(engine, window);
  }
  const FreeSolutions free = window.contour ? aim(window) : FreeSolutions{};
  if (window.shares_motors) {
    return solve_with_shared_motors(engine, window);
  }
  const auto solved = [&](const AxisWindow& axis, const std::optional<AxisSolution>& without) {
    // A solution that keeps the limits by itself is the one within them, too.
    return without && broken(without->base, axis) == ActiveLimits{} ? Result<AxisSolution>(*without)
                                                                    : engine.solve(axis);
  };
  return {map_axes(solved, window, free)};
}

Result<dynamics::BaseTrajectory> solve_all(const Engine& engine,
                                           const std::vector<WindowSpan>& spans,
                                           std::vector<RunWindow>& windows,
                                           const std::function<void(const AxisSolution&)>& each) {
  Axes<std::vector<dynamics::AxisTrajectory>> solutions;
  std::vector<dynamics::AxisTrajectory> thirds;
  for (std::size_t i = 0; i < windows.size(); ++i) {
    AxisSolutions solved = solve(engine, spans[i], windows[i]);
    if (solved.third) {
      if (!*solved.third) {
        return tl::unexpected(std::move(solved.third->error()));
      }
      thirds.push_back(std::move((*solved.third)->base));
    }
    for (std::size_t axis = 0; axis < solved.kCount; ++axis) {
      if (!solved[axis]) {
        return tl::unexpected(std::move(solved[axis].error()));
      }
      if (each) {
        each(*solved[axis]);
      }
      solutions[axis].push_back(std::move(solved[axis]->base));
    }
  }
  dynamics::BaseTrajectory base{
      map_axes([&](const auto& of_axis) { return join(spans, of_axis); }, solutions),
      windows.front().x.period_s};
  if (!windows.front().frame) {
    return base;
  }
  return in_axes(*windows.front().frame, base,
                 thirds.empty() ? std::nullopt : std::optional(join(spans, thirds)),
                 windows.front().motors.value_or(ModeMotors{}).max_z_accel_mm_s2);
}

namespace {

// The motion times a share s(t) ≤ 1 that changes slowly, so small that no acceleration is above the
// limit: z̈ → s z̈ + 2 ṡ ż + s̈ z, of which the first part is by far the largest.
void keep_z_accel(double most_mm_s2, double period_s, dynamics::AxisTrajectory& z) {
  constexpr double kSlow_s = 0.03;
  const std::size_t nodes = z.accel_mm_s2.size();
  const auto reach = static_cast<std::size_t>(kSlow_s / period_s);
  const auto around = [&](std::size_t k) {
    return std::pair(k - std::min(k, reach), std::min(k + reach, nodes - 1));
  };
  std::vector<double> needed(nodes, 1.0);
  for (std::size_t k = 0; k < nodes; ++k) {
    needed[k] = std::min(1.0, most_mm_s2 / std::abs(z.accel_mm_s2[k]));
  }
  if (std::ranges::min(needed) >= 1.0) {
    return;
  }
  // The least share that is needed within the reach. Its mean within the reach, with weights that
  // fall towards both ends, changes slowly.
  std::vector<double> share(nodes);
  for (std::size_t k = 0; k < nodes; ++k) {
    const auto [first, last] = around(k);
    share[k] = *std::min_element(needed.begin() + static_cast<std::ptrdiff_t>(first),
                                 needed.begin() + static_cast<std::ptrdiff_t>(last) + 1);
  }
  std::vector<double> smooth(nodes);
  for (std::size_t k = 0; k < nodes; ++k) {
    const auto [first, last] = around(k);
    double sum = 0.0;
    double weights = 0.0;
    for (std::size_t i = first; i <= last; ++i) {
      const double part = static_cast<double>(i) - static_cast<double>(k);
      const double weight = 1.0 - std::abs(part) / (static_cast<double>(reach) + 1.0);
      sum += weight * share[i];
      weights += weight;
    }
    smooth[k] = sum / weights;
  }
  const dynamics::AxisTrajectory whole = z;
  for (std::size_t k = 0; k < nodes; ++k) {
    const std::size_t before = k > 0 ? k - 1 : k;
    const std::size_t after = k + 1 < nodes ? k + 1 : k;
    const double rate =
        (smooth[after] - smooth[before]) / (static_cast<double>(after - before) * period_s);
    z.position_mm[k] = smooth[k] * whole.position_mm[k];
    z.velocity_mm_s[k] = smooth[k] * whole.velocity_mm_s[k] + rate * whole.position_mm[k];
    z.accel_mm_s2[k] = smooth[k] * whole.accel_mm_s2[k] + 2.0 * rate * whole.velocity_mm_s[k];
  }
}

}  // namespace

dynamics::BaseTrajectory in_axes(const dynamics::ModeFrame& frame,
                                 const dynamics::BaseTrajectory& in_modes,
                                 const std::optional<dynamics::AxisTrajectory>& third,
                                 double max_z_accel_mm_s2) {
  dynamics::BaseTrajectory base = in_modes;
  base.above = third;
  for (const auto member :
       {&dynamics::AxisTrajectory::position_mm, &dynamics::AxisTrajectory::velocity_mm_s,
        &dynamics::AxisTrajectory::accel_mm_s2}) {
    for (std::size_t k = 0; k < base.nodes(); ++k) {
      double& x = (base.x.*member)[k];
      double& y = (base.y.*member)[k];
      const auto at = frame.to_axes({x, y, third ? ((*third).*member)[k] : 0.0});
      x = at[0];
      y = at[1];
      if (base.above) {
        ((*base.above).*member)[k] = at[2];
      }
    }
  }
  if (base.above) {
    keep_z_accel(max_z_accel_mm_s2, base.period_s, *base.above);
  }
  return base;
}

dynamics::AxisTrajectory join(const std::vector<WindowSpan>& spans,
                              const std::vector<dynamics::AxisTrajectory>& solutions) {
  dynamics::AxisTrajectory joined = solutions.front();
  for (std::size_t i = 1; i < spans.size(); ++i) {
    const std::size_t seam = spans[i].core_first;
    const dynamics::AxisTrajectory& next = solutions[i];
    joined.position_mm.resize(spans[i].last + 1);
    joined.velocity_mm_s.resize(spans[i].last + 1);
    joined.accel_mm_s2.resize(spans[i].last + 1);
    for (std::size_t k = seam - kBlendNodes; k <= spans[i].last; ++k) {
      const double s = std::min(
          static_cast<double>(k - (seam - kBlendNodes)) / static_cast<double>(2 * kBlendNodes),
          1.0);
      const double share = s * s * (3.0 - 2.0 * s);  // of the next window
      const auto blend = [&](std::vector<double>& into, const std::vector<double>& from) {
        const double other = from[k - spans[i].first];
        into[k] = s < 1.0 ? into[k] + share * (other - into[k]) : other;
      };
      blend(joined.position_mm, next.position_mm);
      blend(joined.velocity_mm_s, next.velocity_mm_s);
      blend(joined.accel_mm_s2, next.accel_mm_s2);
    }
  }
  return joined;
}

}  // namespace unflex::compensate
