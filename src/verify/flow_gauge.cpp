#include "flow_gauge.hpp"

#include <algorithm>
#include <cmath>

namespace unflex::verify {
namespace {

// A flow that is larger by less than this share counts as equal, so that a constant one has its
// first line.
constexpr double kRounding = 1e-9;

bool is_larger(double value, double than) { return value > than * (1.0 + kRounding); }

// How much y changes until t where dy/dt = rate + slope·t.
double change(double rate, double slope, double t) { return (rate + 0.5 * slope * t) * t; }

// Where y has its extreme; not within (0, duration) if there is none.
double extreme_at(double rate, double slope) { return slope != 0.0 ? -rate / slope : 0.0; }

}  // namespace

FlowGauge::FlowGauge(double filament_area_mm2) : filament_area_mm2_(filament_area_mm2) {
  // Before its first move the machine has stood still.
  stretches_.push_back({.duration_s = 2.0 * kMean_s});
  before_.left_s = kMean_s;
  far_before_.left_s = 2.0 * kMean_s;
}

void FlowGauge::play(const planner::PlannedMove& move) {
  line_ = move.segment.line;
  if (move.segment.length_xy_mm() <= 0.0 || move.segment.delta(gcode::E) <= 0.0) {
    rest(move.duration_s());
    return;
  }
  const double area_mm2 = filament_area_mm2_ * move.direction[gcode::E];
  for (const planner::Phase& phase : move.phases()) {
    add({phase.duration_s, area_mm2 * phase.speed_mm_s, area_mm2 * phase.accel_mm_s2, line_});
  }
}

void FlowGauge::rest(double duration_s) { add({.duration_s = duration_s, .line = line_}); }

void FlowGauge::add(const Stretch& stretch) {
  if (!(stretch.duration_s > 0.0)) {
    return;
  }
  stretches_.push_back(stretch);
  now_ = {stretches_.size() - 1, stretch.duration_s, stretch.flow_mm3_s};
  while (now_.left_s > 0.0) {
    go_on(std::min({now_.left_s, before_.left_s, far_before_.left_s}));
  }
}

void FlowGauge::go_on(double duration_s) {
  const auto slope = [&](const Mark& mark) { return stretches_[mark.stretch].slope_mm3_s2; };
  const double mean_rate = (now_.flow_mm3_s - before_.flow_mm3_s) / kMean_s;
  const double mean_slope = (slope(now_) - slope(before_)) / kMean_s;
  const double change_rate =
      (mean_rate - (before_.flow_mm3_s - far_before_.flow_mm3_s) / kMean_s) / kMean_s;
  const double change_slope =
      (mean_slope - (slope(before_) - slope(far_before_)) / kMean_s) / kMean_s;
  if (const double t = extreme_at(mean_rate, mean_slope); t > 0.0 && t < duration_s) {
    look_at_mean(mean_mm3_s_ + change(mean_rate, mean_slope, t));
  }
  if (const double t = extreme_at(change_rate, change_slope); t > 0.0 && t < duration_s) {
    look_at_change(change_mm3_s2_ + change(change_rate, change_slope, t),
                   stretches_[before_.stretch].line);
  }
  mean_mm3_s_ += change(mean_rate, mean_slope, duration_s);
  change_mm3_s2_ += change(change_rate, change_slope, duration_s);
  look_at_mean(mean_mm3_s_);
  now_.left_s -= duration_s;
  now_.flow_mm3_s += duration_s * slope(now_);
  pass(before_, duration_s);
  pass(far_before_, duration_s);
  look_at_change(change_mm3_s2_, stretches_[before_.stretch].line);
  if (far_before_.stretch > 0) {
    stretches_.pop_front();
    --now_.stretch;
    --before_.stretch;
    --far_before_.stretch;
  }
  const Stretch& first = stretches_.front();
  if (stretches_.size() == 1 && first.flow_mm3_s == 0.0 && first.slope_mm3_s2 == 0.0) {
    // Rounding does not add up beyond a rest.
    mean_mm3_s_ = change_mm3_s2_ = 0.0;
  }
}

void FlowGauge::pass(Mark& mark, double duration_s) {
  mark.left_s -= duration_s;
  mark.flow_mm3_s += duration_s * stretches_[mark.stretch].slope_mm3_s2;
  if (mark.left_s <= 0.0) {
    const Stretch& next = stretches_[++mark.stretch];
    mark.left_s = next.duration_s;
    mark.flow_mm3_s = next.flow_mm3_s;
  }
}

void FlowGauge::look_at_mean(double mean_mm3_s) {
  for (FlowStats* const stats : {&stats_, &section_}) {
    if (is_larger(mean_mm3_s, stats->max_mm3_s)) {
      stats->max_mm3_s = mean_mm3_s;
      stats->max_line = line_;
    }
  }
}

void FlowGauge::look_at_change(double change_mm3_s2, std::size_t line) {
  if (is_larger(std::abs(change_mm3_s2), stats_.max_change_mm3_s2)) {
    stats_.max_change_mm3_s2 = std::abs(change_mm3_s2);
    stats_.max_change_line = line;
  }
}

}  // namespace unflex::verify
