#include "pressed_filament.hpp"

#include <algorithm>
#include <cmath>

#include "unflex/core/math.hpp"

namespace unflex::verify {

PressedFilament::PressedFilament(const dynamics::HotendPressure& hotend) : hotend_(hotend) {
  on_the_way_.push_back({hotend.dead_time_s, 0.0});
}

void PressedFilament::set(const dynamics::HotendPressure& hotend) {
  if (hotend == hotend_) {
    return;
  }
  // The pressure is what it was, so the flow is another one. We find it by Newton's method.
  const double pressed_mm = hotend_.pressed_mm(flow_mm_s_);
  if (hotend.dead_time_s != hotend_.dead_time_s || on_the_way_.empty()) {
    on_the_way_.assign(1, {hotend.dead_time_s, 0.0});
  }
  hotend_ = hotend;
  if (hotend_.slope_s(0.0) > 0.0) {
    constexpr int kMostSteps = 50;
    for (int i = 0; i < kMostSteps; ++i) {
      flow_mm_s_ -= (hotend_.pressed_mm(flow_mm_s_) - pressed_mm) / hotend_.slope_s(flow_mm_s_);
    }
  }
}

double PressedFilament::push(double duration_s, double pushed_mm) {
  if (!(duration_s > 0.0)) {
    return 0.0;
  }
  const double rate_mm_s = pushed_mm / duration_s;
  if (!(hotend_.dead_time_s > 0.0)) {
    return follow(duration_s, rate_mm_s);
  }
  on_the_way_.push_back({duration_s, rate_mm_s});
  double out_mm = 0.0;
  for (double left_s = duration_s; left_s > 0.0;) {
    Stretch& first = on_the_way_.front();
    const double part_s = std::min(first.duration_s, left_s);
    out_mm += follow(part_s, first.rate_mm_s);
    first.duration_s -= part_s;
    left_s -= part_s;
    if (first.duration_s <= 0.0) {
      on_the_way_.pop_front();
    }
  }
  return out_mm;
}

double PressedFilament::follow(double duration_s, double rate_mm_s) {
  // The longest part of a stretch, so short that P' hardly changes in it.
  constexpr double kFine_s = 2e-4;
  const double parts =
      hotend_.shape == dynamics::PressureShape::linear ? 1.0 : std::ceil(duration_s / kFine_s);
  double out_mm = 0.0;
  for (double part = 0.0; part < parts; part += 1.0) {
    out_mm += follow_evenly(duration_s / parts, rate_mm_s);
  }
  return out_mm;
}

double PressedFilament::follow_evenly(double duration_s, double rate_mm_s) {
  const double before_mm_s = flow_mm_s_;
  const auto later = [&](double t, double slope_s) {
    return slope_s > 0.0 ? rate_mm_s + (before_mm_s - rate_mm_s) * math::exp(-t / slope_s)
                         : rate_mm_s;
  };
  const double middle_mm_s = later(0.5 * duration_s, hotend_.slope_s(before_mm_s));
  flow_mm_s_ = later(duration_s, hotend_.slope_s(middle_mm_s));
  return rate_mm_s * duration_s -
         (hotend_.pressed_mm(flow_mm_s_) - hotend_.pressed_mm(before_mm_s));
}

}  // namespace unflex::verify
