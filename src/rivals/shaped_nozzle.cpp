#include "unflex/rivals/shaped_nozzle.hpp"

#include <algorithm>

#include "unflex/dynamics/shaped.hpp"

namespace unflex::rivals {

dynamics::NozzleMotion on_cubic(const dynamics::NozzleMotion& a, const dynamics::NozzleMotion& b,
                                double h, double u) {
  const double rise = b.position - a.position;
  const double from = a.velocity * h;
  const double to = b.velocity * h;
  const double second = 3.0 * rise - 2.0 * from - to;
  const double third = from + to - 2.0 * rise;
  return {a.position + u * (from + u * (second + u * third)),
          (from + u * (2.0 * second + 3.0 * u * third)) / h};
}

ShapedNozzle::ShapedNozzle(const Axes<dynamics::ShaperPulses>& pulses) {
  const auto set = [&](Taps& taps, const dynamics::ShaperPulses& train) {
    taps.pulses = train;
    taps.index.assign(std::max<std::size_t>(train.size(), 1), 0);
    for (const dynamics::Pulse& pulse : taps.pulses) {
      lookahead_s_ = std::max(lookahead_s_, -pulse.time_s);
      memory_s_ = std::max(memory_s_, pulse.time_s);
    }
  };
  for_each_axis(set, taps_, pulses);
}

void ShapedNozzle::add(double time_s, const dynamics::NozzleMotionXY& unshaped) {
  samples_.push_back({time_s, unshaped});
}

dynamics::NozzleMotion ShapedNozzle::sum(std::size_t axis, double time_s) {
  Taps& taps = taps_[axis];
  const auto at = [&](std::size_t tap, double t) -> dynamics::NozzleMotion {
    std::size_t i = std::max(taps.index[tap], forgotten_) - forgotten_;
    while (i + 1 < samples_.size() && samples_[i + 1].time_s <= t) {
      ++i;
    }
    taps.index[tap] = i + forgotten_;
    const Sample& from = samples_[i];
    if (t < from.time_s || i + 1 == samples_.size()) {
      return {from.nozzle[axis].position, 0.0};
    }
    const Sample& to = samples_[i + 1];
    const double h = to.time_s - from.time_s;
    return on_cubic(from.nozzle[axis], to.nozzle[axis], h, (t - from.time_s) / h);
  };
  return dynamics::shaped_at<dynamics::NozzleMotion>(taps.pulses, time_s, at);
}

void ShapedNozzle::forget_before(double time_s) {
  while (samples_.size() > 2 && samples_[1].time_s <= time_s) {
    samples_.pop_front();
    ++forgotten_;
  }
}

dynamics::NozzleMotionXY ShapedNozzle::at(double time_s) {
  dynamics::NozzleMotionXY result;
  for (std::size_t axis = 0; axis < result.kCount; ++axis) {
    result[axis] = sum(axis, time_s);
  }
  forget_before(time_s - memory_s_);
  return result;
}

}  // namespace unflex::rivals
