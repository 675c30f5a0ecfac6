#include "progress_timing.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "unflex/verify/nearest_along.hpp"

namespace unflex::verify {
namespace {

// Filament comes early or late by up to this, since it is laid in whole steps or spread over some
// lines.
constexpr double kSpread_mm = 0.01;
// λ: the share of the distance along the path that counts, so that s goes as far as the base does
// where the path comes back to itself.
constexpr double kAsExpected = 0.02;
// The nearest place is looked for up to this far beyond the expected one.
constexpr double kAhead_mm = 2.0;
// A passage may be left out if its place is within this distance of even motion without it.
constexpr double kSamePlace_mm = 1e-4;

// Adds a passage, and drops the one before it where the speed does not change.
void add(std::vector<Passage>& timing, Passage passage) {
  if (timing.size() >= 2) {
    const Passage& from = timing[timing.size() - 2];
    Passage& last = timing.back();
    const double lasts_s = passage.time_s - from.time_s;
    if (lasts_s > 0.0) {
      const double even_mm = from.covered_mm + (passage.covered_mm - from.covered_mm) *
                                                   (last.time_s - from.time_s) / lasts_s;
      if (std::abs(even_mm - last.covered_mm) < kSamePlace_mm) {
        last = passage;
        return;
      }
    }
  }
  timing.push_back(passage);
}

}  // namespace

void ProgressTiming::begin(double rounding_mm) {
  rounding_mm_ = rounding_mm;
  sliced_.clear();
  passed_.clear();
  at_ = {};
  time_s_ = laid_mm_ = end_mm_ = end_filament_mm_ = 0.0;
  sliced_ended_ = emitted_ended_ = false;
}

bool ProgressTiming::next(ReferenceMove& move) {
  while (passed_.empty() && has_move(0)) {
    planner::PlannedMove line;
    if (!emitted_ended_ && emitted_source_(line)) {
      follow(line);
    } else {
      emitted_ended_ = true;
      pass_as_sliced();
    }
  }
  if (passed_.empty()) {
    return false;
  }
  move = std::move(passed_.front());
  passed_.pop_front();
  return true;
}

bool ProgressTiming::read_sliced() {
  planner::PlannedMove move;
  sliced_ended_ = sliced_ended_ || !sliced_source_(move);
  if (sliced_ended_) {
    return false;
  }
  Sliced& added = sliced_.emplace_back();
  added.begin_mm = end_mm_;
  added.length_mm = move.segment.length_xy_mm();
  added.filament_mm = end_filament_mm_;
  end_mm_ += added.length_mm;
  end_filament_mm_ += move.segment.delta(gcode::E);
  added.reference = {std::move(move), {{0.0, 0.0}}};
  return true;
}

bool ProgressTiming::has_move(std::size_t number) {
  while (number >= sliced_.size()) {
    if (!read_sliced()) {
      return false;
    }
  }
  return true;
}

// Q at the place.
double ProgressTiming::filament_at(const Place& place) const {
  const Sliced& on = sliced_[place.move];
  const double share = on.length_mm > 0.0 ? place.along_mm / on.length_mm : 1.0;
  return on.filament_mm + share * on.reference.move.segment.delta(gcode::E);
}

bool ProgressTiming::agrees(double filament_mm) const {
  return std::abs(filament_mm - laid_mm_) <= kSpread_mm;
}

// The first place from here on where Q agrees with F; `from` if there is none.
ProgressTiming::Place ProgressTiming::first_agreeing(Place from) {
  for (Place place = from; has_move(place.move); place = {place.move + 1, 0.0}) {
    const double begin_mm = filament_at(place);
    if (agrees(begin_mm)) {
      return place;
    }
    const Sliced& on = sliced_[place.move];
    const double end_mm = on.filament_mm + on.reference.move.segment.delta(gcode::E);
    // The end of the agreeing interval that is met first.
    const double wanted_mm = begin_mm < laid_mm_ ? laid_mm_ - kSpread_mm : laid_mm_ + kSpread_mm;
    if ((begin_mm - wanted_mm) * (end_mm - wanted_mm) <= 0.0) {
      const double share = (wanted_mm - begin_mm) / (end_mm - begin_mm);
      return {place.move, place.along_mm + share * (on.length_mm - place.along_mm)};
    }
  }
  return from;
}

// The place nearest to the base from here on, as far as Q agrees with F. expected_mm: s if the path
// is as long as the base's.
ProgressTiming::Place ProgressTiming::nearest(Place from, const gcode::Position& base_mm,
                                              double expected_mm) {
  const XY base_xy_mm = xy_of(base_mm);
  Place best = from;
  double least = std::numeric_limits<double>::infinity();
  for (Place place = from;;) {
    const Sliced& on = sliced_[place.move];
    const gcode::Segment& segment = on.reference.move.segment;
    const XY start_mm = xy_of(segment.start_mm);
    const XY way_mm = xy_of(segment.end_mm) - start_mm;
    const double delta_mm = segment.delta(gcode::E);
    // Where Q leaves F behind on this move.
    double until_mm = on.length_mm;
    if (delta_mm != 0.0 && on.length_mm > 0.0) {
      const double most_mm = laid_mm_ + std::copysign(kSpread_mm, delta_mm);
      until_mm = std::clamp((most_mm - on.filament_mm) / delta_mm, 0.0, 1.0) * on.length_mm;
    }
    until_mm = std::max(until_mm, place.along_mm);
    double along_mm = until_mm;
    if (on.length_mm > 0.0) {
      along_mm =
          nearest_along_mm(base_xy_mm - start_mm, way_mm, on.length_mm, place.along_mm, until_mm);
    }
    const double share = on.length_mm > 0.0 ? along_mm / on.length_mm : 1.0;
    // distance2_mm2() wants a direction of length 1. The division for it would round otherwise.
    const XY off_mm = start_mm + share * way_mm - base_xy_mm;
    const double ahead_mm = on.begin_mm + along_mm - expected_mm;
    const double cost = squared(off_mm) + kAsExpected * ahead_mm * ahead_mm;
    if (cost <= least) {
      least = cost;
      best = {place.move, along_mm};
    }
    const bool ends_here = until_mm < on.length_mm;
    if (ends_here || on.begin_mm + on.length_mm > expected_mm + kAhead_mm ||
        !has_move(place.move + 1) || !agrees(sliced_[place.move + 1].filament_mm)) {
      break;
    }
    place = {place.move + 1, 0.0};
  }
  // The run has not ended before its last filament has come.
  const Sliced& on = sliced_[best.move];
  if (best.along_mm >= on.length_mm && !has_move(best.move + 1) &&
      std::abs(end_filament_mm_ - laid_mm_) > rounding_mm_) {
    best.along_mm =
        std::max(best.move == from.move ? from.along_mm : 0.0, on.length_mm * (1.0 - 1e-9));
  }
  return best;
}

// The reference comes to the place at this time, at even speed.
void ProgressTiming::go_to(const Place& place, double time_s) {
  const double from_mm = s_of(at_);
  const double way_mm = s_of(place) - from_mm;
  const double from_s = time_s_;
  const auto time_at = [&](double s_mm) {
    return way_mm > 0.0 ? from_s + (s_mm - from_mm) / way_mm * (time_s - from_s) : time_s;
  };
  std::size_t left = place.move;
  for (; left > 0; --left) {
    Sliced& on = sliced_.front();
    const double end_s = time_at(on.begin_mm + on.length_mm);
    add(on.reference.timing, {end_s - on.begin_s, on.reference.move.length_mm});
    passed_.push_back(std::move(on.reference));
    sliced_.pop_front();
    sliced_.front().begin_s = end_s;
  }
  Sliced& on = sliced_.front();
  const double share = on.length_mm > 0.0 ? place.along_mm / on.length_mm : 1.0;
  add(on.reference.timing, {time_s - on.begin_s, share * on.reference.move.length_mm});
  at_ = {0, place.along_mm};
  time_s_ = time_s;
  if (share >= 1.0) {
    passed_.push_back(std::move(on.reference));
    sliced_.pop_front();
    at_ = {};
    if (has_move(0)) {
      sliced_.front().begin_s = time_s;
    }
  }
}

void ProgressTiming::follow(const planner::PlannedMove& line) {
  laid_mm_ += line.segment.delta(gcode::E);
  const double expected_mm = s_of(at_) + line.segment.length_xy_mm();
  const Place from = first_agreeing(at_);
  go_to(nearest(from, line.segment.end_mm, std::max(expected_mm, s_of(from))),
        time_s_ + line.duration_s());
}

// The emitted file has ended too early.
void ProgressTiming::pass_as_sliced() {
  const Sliced& on = sliced_.front();
  const double share = on.length_mm > 0.0 ? at_.along_mm / on.length_mm : 0.0;
  go_to({0, on.length_mm}, time_s_ + (1.0 - share) * on.reference.move.duration_s());
}

}  // namespace unflex::verify
