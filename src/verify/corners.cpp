#include "unflex/verify/corners.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace unflex::verify {
namespace {

constexpr double kCosineOfSharpest = 0.93969262078590838;  // cos 20°
constexpr double kNever = std::numeric_limits<double>::infinity();

}  // namespace

void CornerAccumulator::add(double distance2_mm2, std::size_t line) {
  corners_.add_square(distance2_mm2, 1.0);
  sum_distance2_ += distance2_mm2;
  ++count_;
  if (distance2_mm2 > distance2_max_) {
    distance2_max_ = distance2_mm2;
    line_ = line;
  }
}

CornerStats CornerAccumulator::stats() const {
  CornerStats stats;
  if (count_ == 0) {
    return stats;
  }
  stats.count = count_;
  stats.max_mm = std::sqrt(distance2_max_);
  stats.p99_mm = std::min(stats.max_mm, corners_.quantile(0.99));
  stats.rms_mm = std::sqrt(sum_distance2_ / static_cast<double>(count_));
  stats.max_line = line_;
  return stats;
}

void CornerGauge::follow(const planner::PlannedMove& move, double start_s, double end_s) {
  const gcode::Segment& segment = move.segment;
  const double length_mm = segment.length_xy_mm();
  if (!(length_mm > 0.0)) {
    return;
  }
  const XY start_mm = xy_of(segment.start_mm);
  const XY direction = (xy_of(segment.end_mm) - start_mm) / length_mm;
  if (open_) {
    const bool goes_on = segment.extruding() && start_mm == xy_of(end_mm_) &&
                         segment.start_mm[gcode::Z] == end_mm_[gcode::Z];
    if (goes_on && dot(direction, direction_) < kCosineOfSharpest) {
      corners_.back().until_s = start_s + reach_s_;
    } else {
      corners_.pop_back();
    }
  }
  open_ = segment.extruding();
  if (open_) {
    end_mm_ = segment.end_mm;
    direction_ = direction;
    corners_.push_back({end_s - reach_s_, kNever, xy_of(end_mm_), kNever, segment.line, false});
  }
  find_next();
}

void CornerGauge::look(double time_s, const XY& place_mm) {
  while (!corners_.empty() && corners_.front().until_s < time_s) {
    let_go();
  }
  const XY way_mm = drawn_ ? last_mm_ - place_mm : XY{};
  const double way2 = squared(way_mm);
  const double inverse_way2 = way2 > 0.0 ? 1.0 / way2 : 0.0;
  for (Corner& corner : corners_) {
    if (time_s < corner.from_s) {
      break;
    }
    const XY off_mm = corner.place_mm - place_mm;
    const double share = std::clamp(dot(off_mm, way_mm) * inverse_way2, 0.0, 1.0);
    corner.distance2_mm2 = std::min(corner.distance2_mm2, squared(off_mm - share * way_mm));
  }
  drawn_ = true;
  last_mm_ = place_mm;
}

void CornerGauge::miss(double time_s) {
  drawn_ = false;
  while (!corners_.empty() && corners_.front().until_s < time_s) {
    let_go();
  }
  for (Corner& corner : corners_) {
    if (time_s < corner.from_s) {
      break;
    }
    corner.missed = true;
  }
}

void CornerGauge::let_go() {
  // A nozzle that nobody looked at has no distance.
  if (!corners_.front().missed && corners_.front().distance2_mm2 < kNever) {
    left_behind_.add(corners_.front().distance2_mm2, corners_.front().line);
  }
  corners_.pop_front();
  find_next();
}

void CornerGauge::find_next() { next_s_ = corners_.empty() ? kNever : corners_.front().from_s; }

CornerStats CornerGauge::stats() const {
  CornerAccumulator all = left_behind_;
  for (const Corner& corner : corners_) {
    if (!corner.missed && corner.until_s < kNever && corner.distance2_mm2 < kNever) {
      all.add(corner.distance2_mm2, corner.line);
    }
  }
  return all.stats();
}

}  // namespace unflex::verify
