#include "unflex/compensate/second_stage.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "unflex/dynamics/shaped.hpp"

namespace unflex::compensate {
namespace {

// The train of pulses that has the effect of both trains, one after the other.
dynamics::ShaperPulses both(const dynamics::ShaperPulses& a, const dynamics::ShaperPulses& b) {
  if (a.empty() || b.empty()) {
    return a.empty() ? b : a;
  }
  dynamics::ShaperPulses result;
  for (const dynamics::Pulse& p : a) {
    for (const dynamics::Pulse& q : b) {
      result.push_back({p.time_s + q.time_s, p.weight * q.weight});
    }
  }
  return result;
}

Axes<dynamics::ShaperPulses> pulses_of(const Setup& setup) {
  return setup.shares_motors ? on_all_axes(both(setup.x.pulses, setup.y.pulses))
                             : map_axes([](const AxisSetup& axis) { return axis.pulses; }, setup);
}

double reach_s(const dynamics::ShaperPulses& pulses) {
  double reach = 0.0;
  for (const dynamics::Pulse& pulse : pulses) {
    reach = std::max(reach, std::abs(pulse.time_s));
  }
  return reach;
}

// b at t seconds behind the first node.
dynamics::AxisMotion motion_at(const dynamics::AxisTrajectory& base, double t, double h) {
  const std::size_t last = base.position_mm.size() - 1;
  if (t < 0.0) {
    return {base.position_mm.front(), 0.0, 0.0};
  }
  if (t > static_cast<double>(last) * h) {
    return {base.position_mm.back(), 0.0, 0.0};
  }
  const auto k = std::min(static_cast<std::size_t>(t / h), last - 1);
  return dynamics::between(base, k, t - static_cast<double>(k) * h, h);
}

dynamics::AxisTrajectory shaped(const dynamics::AxisTrajectory& base, double h,
                                const dynamics::ShaperPulses& pulses, std::size_t more_before,
                                std::size_t more_after) {
  const std::size_t nodes = base.position_mm.size() + more_before + more_after;
  dynamics::AxisTrajectory result;
  for (std::size_t k = 0; k < nodes; ++k) {
    const double t = (static_cast<double>(k) - static_cast<double>(more_before)) * h;
    const auto sum = dynamics::shaped_at<dynamics::AxisMotion>(
        pulses, t, [&](std::size_t, double at_s) { return motion_at(base, at_s, h); });
    result.position_mm.push_back(sum.position_mm);
    result.velocity_mm_s.push_back(sum.velocity_mm_s);
    result.accel_mm_s2.push_back(sum.accel_mm_s2);
  }
  return result;
}

}  // namespace

std::size_t nodes_of_shaping(const Setup& setup, double period_s) {
  return static_cast<std::size_t>(std::ceil(most_of_axes(reach_s, pulses_of(setup)) / period_s));
}

dynamics::BaseTrajectory shaped(const dynamics::BaseTrajectory& base, const Setup& setup,
                                std::size_t more_before, std::size_t more_after) {
  const Axes<dynamics::ShaperPulses> pulses = pulses_of(setup);
  const auto is_empty = [](const dynamics::ShaperPulses& of_axis) { return of_axis.empty(); };
  if (all_axes(is_empty, pulses) && more_before + more_after == 0) {
    return base;
  }
  return {map_axes(
              [&](const dynamics::AxisTrajectory& axis, const dynamics::ShaperPulses& of_axis) {
                return shaped(axis, base.period_s, of_axis, more_before, more_after);
              },
              base, pulses),
          base.period_s};
}

}  // namespace unflex::compensate
