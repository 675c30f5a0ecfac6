#include "unflex/rivals/shaped_nozzle.hpp"

#include <algorithm>
#include <limits>

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
  const auto set = [&](std::vector<Tap>& taps, const dynamics::ShaperPulses& train) {
    for (const dynamics::Pulse& pulse :
         train.empty() ? dynamics::ShaperPulses{{0.0, 1.0}} : train) {
      taps.push_back({pulse});
      lookahead_s_ = std::max(lookahead_s_, -pulse.time_s);
      memory_s_ = std::max(memory_s_, pulse.time_s);
    }
  };
  for_each_axis(set, taps_, pulses);
}

void ShapedNozzle::add(double time_s, const dynamics::NozzleMotionXY& unshaped) {
  samples_.push_back({time_s, unshaped});
}

double ShapedNozzle::known_until_s() const {
  return samples_.empty() ? -std::numeric_limits<double>::infinity()
                          : samples_.back().time_s - lookahead_s_;
}

dynamics::NozzleMotion ShapedNozzle::sum(std::size_t axis, double time_s) {
  dynamics::NozzleMotion result;
  for (Tap& tap : taps_[axis]) {
    const double t = time_s - tap.pulse.time_s;
    std::size_t i = std::max(tap.index, forgotten_) - forgotten_;
    while (i + 1 < samples_.size() && samples_[i + 1].time_s <= t) {
      ++i;
    }
    tap.index = i + forgotten_;
    const Sample& from = samples_[i];
    dynamics::NozzleMotion delayed{from.nozzle[axis].position, 0.0};
    if (t >= from.time_s && i + 1 < samples_.size()) {
      const Sample& to = samples_[i + 1];
      const double h = to.time_s - from.time_s;
      delayed = on_cubic(from.nozzle[axis], to.nozzle[axis], h, (t - from.time_s) / h);
    }
    result.position += tap.pulse.weight * delayed.position;
    result.velocity += tap.pulse.weight * delayed.velocity;
  }
  return result;
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
