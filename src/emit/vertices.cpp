#include "vertices.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

namespace unflex::emit {
namespace {

// First moments of the base's distance from the chord of one line, mm·s, against the two halves of
// the hat functions: ∫ (b − chord)(1 − s) dt and ∫ (b − chord) s dt, s from 0 to 1 along the line.
struct ChordError {
  double towards_start = 0.0;
  double towards_end = 0.0;
};

ChordError chord_error(const dynamics::BaseTrajectory& base, AxisAt axis, double from, double to) {
  // Two samples per node period; b is smooth, so the trapezoidal rule does.
  const double duration = to - from;
  const int steps = std::max(4, static_cast<int>(std::ceil(2.0 * duration / base.period_s)));
  const double b0 = (base.*axis)(from).position_mm;
  const double b1 = (base.*axis)(to).position_mm;
  ChordError sum;
  for (int i = 1; i < steps; ++i) {
    const double s = static_cast<double>(i) / steps;
    const double error = (base.*axis)(from + s * duration).position_mm - b0 - s * (b1 - b0);
    sum.towards_start += error * (1.0 - s);
    sum.towards_end += error * s;
  }
  const double weight = duration / steps;
  return {sum.towards_start * weight, sum.towards_end * weight};
}

// The furthest the base goes on one axis, at its nodes.
std::pair<double, double> extent(const dynamics::BaseTrajectory& base, AxisAt axis) {
  double lowest = (base.*axis)(0.0).position_mm;
  double highest = lowest;
  for (std::size_t k = 1; k < base.nodes(); ++k) {
    const double at = (base.*axis)(static_cast<double>(k) * base.period_s).position_mm;
    lowest = std::min(lowest, at);
    highest = std::max(highest, at);
  }
  return {lowest, highest};
}

}  // namespace

std::vector<double> vertices(const dynamics::BaseTrajectory& base, AxisAt axis,
                             const std::vector<double>& times, double max_accel_mm_s2) {
  const std::size_t n = times.size();
  std::vector<double> on_curve(n);
  std::vector<double> offset(n, 0.0);
  for (std::size_t i = 0; i < n; ++i) {
    on_curve[i] = (base.*axis)(times[i]).position_mm;
  }
  const auto [lowest, highest] = extent(base, axis);
  ChordError before = chord_error(base, axis, times[0], times[1]);
  for (std::size_t i = 1; i + 1 < n; ++i) {
    const ChordError after = chord_error(base, axis, times[i], times[i + 1]);
    offset[i] = (before.towards_end + after.towards_start) / (0.5 * (times[i + 1] - times[i - 1]));
    offset[i] = std::clamp(on_curve[i] + offset[i], lowest, highest) - on_curve[i];
    before = after;
  }
  const auto accel = [&](std::size_t i) {
    const double t1 = times[i] - times[i - 1];
    const double t2 = times[i + 1] - times[i];
    const auto at = [&](std::size_t j) { return on_curve[j] + offset[j]; };
    return std::abs((at(i + 1) - at(i)) / t2 - (at(i) - at(i - 1)) / t1) / (0.5 * (t1 + t2));
  };
  for (bool changed = true; changed;) {
    changed = false;
    for (std::size_t i = 1; i + 1 < n; ++i) {
      if (accel(i) > max_accel_mm_s2 &&
          (offset[i - 1] != 0.0 || offset[i] != 0.0 || offset[i + 1] != 0.0)) {
        offset[i - 1] = offset[i] = offset[i + 1] = 0.0;
        changed = true;
      }
    }
  }
  for (std::size_t i = 0; i < n; ++i) {
    on_curve[i] += offset[i];
  }
  return on_curve;
}

}  // namespace unflex::emit
