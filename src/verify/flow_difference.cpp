#include "flow_difference.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace unflex::verify {
namespace {

// A difference that is larger by less than this counts as equal, so that an even difference has its
// first line.
constexpr double kRounding = 1e-9;
// A sliced file that lays less filament than this in the window, 10 µm/s, is no measure.
constexpr double kLeast_mm = 1e-4;

// The roots of a·t² + b·t + c = 0; 0 in place of one that there is not.
std::array<double, 2> roots(double a, double b, double c) {
  const double discriminant = b * b - 4.0 * a * c;
  if (!(discriminant >= 0.0)) {
    return {};
  }
  // Both terms have one sign, so nothing cancels.
  const double q = -0.5 * (b + std::copysign(std::sqrt(discriminant), b));
  return {a != 0.0 ? q / a : 0.0, q != 0.0 ? c / q : 0.0};
}

}  // namespace

void FlowDifferenceGauge::begin_run(double lead_in_s) {
  sliced_.clear();
  output_.clear();
  clear_window();
  if (lead_in_s > 0.0) {
    append_rest(lead_in_s, sliced_);
  }
}

void FlowDifferenceGauge::play_sliced(const planner::PlannedMove& move) {
  append(move, sliced_);
  compare();
}

void FlowDifferenceGauge::play_output(const planner::PlannedMove& move) {
  append(move, output_);
  compare();
}

void FlowDifferenceGauge::end_run() {
  double left_s = 0.0;
  for (const Phase& phase : sliced_) {
    left_s += phase.left_s;
  }
  append_rest(left_s, output_);
  compare();
  begin_run(0.0);
}

std::optional<FlowDifference> FlowDifferenceGauge::stats() const {
  std::optional<FlowDifference> stats = largest_;
  if (stats) {
    stats->p99 = std::min(std::abs(stats->relative), relative_s_.quantile(0.99));
  }
  return stats;
}

void FlowDifferenceGauge::append(const planner::PlannedMove& move, std::deque<Phase>& phases) {
  const double filament_mm = move.segment.delta(gcode::E);
  const double per_mm = move.direction[gcode::E];
  const bool lays = move.segment.length_xy_mm() > 0.0 && filament_mm > 0.0;
  for (const planner::Phase& phase : move.phases()) {
    if (phase.duration_s > 0.0) {
      phases.push_back({phase.duration_s,
                        {per_mm * phase.speed_mm_s, per_mm * phase.accel_mm_s2},
                        move.segment.line,
                        lays});
    }
  }
}

void FlowDifferenceGauge::append_rest(double duration_s, std::deque<Phase>& phases) {
  Phase rest;
  rest.left_s = duration_s;
  phases.push_back(rest);
}

// Compares the phases that are known of both files.
void FlowDifferenceGauge::compare() {
  while (!sliced_.empty() && !output_.empty()) {
    Phase& sliced = sliced_.front();
    Phase& output = output_.front();
    const double duration_s = std::min(sliced.left_s, output.left_s);
    if (sliced.lays) {
      add({duration_s,
           sliced.rate,
           {output.rate.value - sliced.rate.value, output.rate.slope - sliced.rate.slope},
           sliced.line});
    } else {
      clear_window();
    }
    for (std::deque<Phase>* const phases : {&sliced_, &output_}) {
      Phase& phase = phases->front();
      phase.left_s -= duration_s;
      phase.rate = phase.rate.after(duration_s);
      if (!(phase.left_s > 0.0)) {
        phases->pop_front();
      }
    }
  }
}

void FlowDifferenceGauge::add(Stretch stretch) {
  if (!(stretch.left_s > 0.0)) {
    return;
  }
  Rate sliced = stretch.sliced;
  Rate difference = stretch.difference;
  double left_s = stretch.left_s;
  window_.push_back(stretch);
  if (filled_s_ < kWindow_s) {
    const double fills_s = std::min(left_s, kWindow_s - filled_s_);
    sliced_mm_ += sliced.integral(fills_s);
    difference_mm_ += difference.integral(fills_s);
    if (fills_s < kWindow_s - filled_s_) {
      filled_s_ += fills_s;
      return;
    }
    filled_s_ = kWindow_s;
    look_at(sliced_mm_, difference_mm_, 0.0);
    left_s -= fills_s;
    sliced = sliced.after(fills_s);
    difference = difference.after(fills_s);
  }
  while (left_s > 0.0) {
    const double duration_s = std::min(left_s, window_.front().left_s);
    go_on(sliced, difference, duration_s);
    left_s -= duration_s;
    sliced = sliced.after(duration_s);
    difference = difference.after(duration_s);
  }
}

// Moves both marks on. The rates are those at the mark in front.
void FlowDifferenceGauge::go_on(const Rate& sliced, const Rate& difference, double duration_s) {
  Stretch& back = window_.front();
  const Rate s{sliced.value - back.sliced.value, sliced.slope - back.sliced.slope};
  const Rate d{difference.value - back.difference.value, difference.slope - back.difference.slope};
  for (const double t : roots(0.5 * (d.slope * s.value - d.value * s.slope),
                              d.slope * sliced_mm_ - difference_mm_ * s.slope,
                              d.value * sliced_mm_ - difference_mm_ * s.value)) {
    if (t > 0.0 && t < duration_s) {
      look_at(sliced_mm_ + s.integral(t), difference_mm_ + d.integral(t), t);
    }
  }
  sliced_mm_ += s.integral(duration_s);
  difference_mm_ += d.integral(duration_s);
  look_at(sliced_mm_, difference_mm_, duration_s);
  if (sliced_mm_ > kLeast_mm) {
    const double relative = difference_mm_ / sliced_mm_;
    relative_s_.add_square(relative * relative, duration_s);
  }
  back.left_s -= duration_s;
  back.sliced = back.sliced.after(duration_s);
  back.difference = back.difference.after(duration_s);
  if (!(back.left_s > 0.0)) {
    window_.pop_front();
  }
}

// later_s: how much later the window ends than the one at hand.
void FlowDifferenceGauge::look_at(double sliced_mm, double difference_mm, double later_s) {
  if (!(sliced_mm > kLeast_mm)) {
    return;
  }
  const double relative = difference_mm / sliced_mm;
  if (!largest_ ||
      std::abs(relative) > std::abs(largest_->relative) * (1.0 + kRounding) + kRounding) {
    largest_ = {relative, line_in_middle(later_s), 0.0};
  }
}

std::size_t FlowDifferenceGauge::line_in_middle(double later_s) const {
  double to_middle_s = 0.5 * kWindow_s + later_s;
  for (const Stretch& stretch : window_) {
    if (to_middle_s < stretch.left_s) {
      return stretch.line;
    }
    to_middle_s -= stretch.left_s;
  }
  return window_.back().line;
}

void FlowDifferenceGauge::clear_window() {
  window_.clear();
  filled_s_ = sliced_mm_ = difference_mm_ = 0.0;
}

}  // namespace unflex::verify
