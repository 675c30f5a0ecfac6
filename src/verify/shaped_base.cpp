#include "shaped_base.hpp"

#include <array>
#include <limits>

namespace unflex::verify {
namespace {

constexpr double kSameTime_s = 1e-10;

dynamics::BaseSegment later(const dynamics::BaseSegment& base, double h) {
  return {base.position + h * (base.velocity + 0.5 * base.acceleration * h),
          base.velocity + base.acceleration * h, base.acceleration};
}

// The motion of this much filament, counted from the start of the move.
dynamics::BaseSegment along_filament(const planner::PlannedMove& move, double filament_mm,
                                     double distance_mm, const planner::Phase& phase) {
  const double per_mm = filament_mm != 0.0 ? filament_mm / move.length_mm : 0.0;
  return {per_mm * distance_mm, per_mm * phase.speed_mm_s, per_mm * phase.accel_mm_s2};
}

}  // namespace

dynamics::BaseXY resting_at(const XY& place_mm) {
  return map_axes([](double at_mm) { return dynamics::BaseSegment{at_mm, 0.0, 0.0}; }, place_mm);
}

void append_phases(const planner::PlannedMove& move, double pushed_mm,
                   std::vector<BasePhase>& phases) {
  double elapsed_s = 0.0;
  const double laid_mm = move.segment.extruding() ? move.segment.delta(gcode::E) : 0.0;
  // A wipe. In a run that is written for the hotend, lines may draw back where they lay.
  const bool draws_back = pushed_mm < 0.0 && pushed_mm == move.segment.delta(gcode::E);
  pushed_mm = move.segment.moves_xy() && !draws_back ? pushed_mm : 0.0;
  for (const planner::Phase& phase : move.phases()) {
    if (phase.duration_s <= 0.0) {
      continue;
    }
    const double distance_mm = move.distance_mm(elapsed_s);
    const auto along = [&](double start_mm, double direction) {
      const double ratio = move.kinematic ? direction : 0.0;
      return dynamics::BaseSegment{start_mm + ratio * distance_mm, ratio * phase.speed_mm_s,
                                   ratio * phase.accel_mm_s2};
    };
    phases.push_back({map_axes(along, xy_of(move.segment.start_mm), xy_of(move.direction)),
                      along(move.segment.start_mm[gcode::Z], move.direction[gcode::Z]),
                      along_filament(move, laid_mm, distance_mm, phase),
                      along_filament(move, pushed_mm, distance_mm, phase), phase.duration_s,
                      move.segment.extruding()});
    elapsed_s += phase.duration_s;
  }
}

ShapedBase::ShapedBase(const planner::Shaping& shaping, const XY& place_mm)
    : lead_s_(shaping.lead_s()) {
  const auto set = [&](std::vector<Tap>& taps, const dynamics::ShaperPulses& pulses) {
    if (pulses.empty()) {
      taps.push_back({lead_s_, 1.0});
    }
    for (const dynamics::Pulse& pulse : pulses) {
      taps.push_back({lead_s_ + pulse.time_s, pulse.weight});
      memory_s_ = std::max(memory_s_, taps.back().delay_s);
    }
  };
  memory_s_ = lead_s_;
  for_each_axis(set, xy_, shaping);
  set(e_, {});
  // The base has rested for as long as the pulses look back.
  given_until_s_ = -memory_s_ - 1.0;
  give({.xy = resting_at(place_mm), .duration_s = memory_s_ + 1.0});
}

void ShapedBase::give(const BasePhase& phase) {
  given_.push_back({given_until_s_, phase});
  given_until_s_ += phase.duration_s;
}

void ShapedBase::add(const planner::PlannedMove& move, std::vector<BasePhase>& shaped) {
  std::vector<BasePhase> phases;
  append_phases(move, move.segment.delta(gcode::E), phases);
  for (BasePhase& phase : phases) {
    phase.e.position += filament_mm_;
    give(phase);
  }
  filament_mm_ += move.segment.extruding() ? move.segment.delta(gcode::E) : 0.0;
  advance(shaped);
}

void ShapedBase::finish(std::vector<BasePhase>& until_end, std::vector<BasePhase>& behind) {
  rest(lead_s_, until_end);
  rest(memory_s_ - lead_s_, behind);
}

void ShapedBase::rest(double duration_s, std::vector<BasePhase>& shaped) {
  if (duration_s <= kSameTime_s) {
    return;
  }
  const Timed& last = given_.back();
  const auto at_end = [&](const dynamics::BaseSegment& base) {
    return later(base, last.phase.duration_s).position;
  };
  give({.xy = resting_at(map_axes(at_end, last.phase.xy)),
        .z = {at_end(last.phase.z), 0.0, 0.0},
        .e = {filament_mm_, 0.0, 0.0},
        .duration_s = duration_s});
  advance(shaped);
}

template <typename Part>
dynamics::BaseSegment ShapedBase::sum(const std::vector<Tap>& taps, const Part& part) const {
  dynamics::BaseSegment result;
  for (const Tap& tap : taps) {
    const Timed& at = given_[tap.index - forgotten_];
    const dynamics::BaseSegment base = later(part(at.phase), time_s_ - tap.delay_s - at.start_s);
    result.position += tap.weight * base.position;
    result.velocity += tap.weight * base.velocity;
    result.acceleration += tap.weight * base.acceleration;
  }
  return result;
}

void ShapedBase::advance(std::vector<BasePhase>& shaped) {
  while (given_until_s_ - time_s_ > kSameTime_s) {
    double until_s = std::min(given_until_s_, next_change(e_));
    for_each_axis([&](std::vector<Tap>& taps) { until_s = std::min(until_s, next_change(taps)); },
                  xy_);
    BasePhase phase;
    for (std::size_t axis = 0; axis < dynamics::BaseXY::kCount; ++axis) {
      phase.xy[axis] = sum(xy_[axis], [axis](const BasePhase& of) { return of.xy[axis]; });
    }
    phase.z = sum(e_, [](const BasePhase& of) { return of.z; });
    phase.e = sum(e_, [](const BasePhase& of) { return of.e; });
    phase.pushed = sum(e_, [](const BasePhase& of) { return of.pushed; });
    phase.duration_s = until_s - time_s_;
    phase.extruding = given_[e_.front().index - forgotten_].phase.extruding;
    shaped.push_back(phase);
    time_s_ = until_s;
  }
  while (given_.size() > 1 && given_[1].start_s <= time_s_ - memory_s_) {
    given_.pop_front();
    ++forgotten_;
  }
}

// The first time after now at which a tap comes to another phase. Moves the taps to their phases of
// now.
double ShapedBase::next_change(std::vector<Tap>& taps) {
  double change_s = std::numeric_limits<double>::infinity();
  for (Tap& tap : taps) {
    tap.index = std::max(tap.index, forgotten_);
    const double t = time_s_ - tap.delay_s;
    while (tap.index - forgotten_ + 1 < given_.size() &&
           given_[tap.index - forgotten_ + 1].start_s <= t + kSameTime_s) {
      ++tap.index;
    }
    const Timed& at = given_[tap.index - forgotten_];
    change_s = std::min(change_s, at.start_s + at.phase.duration_s + tap.delay_s);
  }
  return change_s;
}

}  // namespace unflex::verify
