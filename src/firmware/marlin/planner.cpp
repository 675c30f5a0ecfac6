// The buffer of blocks and the speeds at their junctions.
//
// Source: Marlin 2.1.2, src/module/planner.cpp: buffer_segment, _buffer_steps, get_current_block,
// recalculate and its passes. Trapezoids are made once, when a block begins to run. The firmware
// makes them anew whenever a speed changes, in the end from the same two speeds.
#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "firmware_planner.hpp"
#include "marlin_block.hpp"
#include "marlin_integers.hpp"
#include "marlin_trapezoid.hpp"
#include "unflex/planner/marlin_planner.hpp"

namespace unflex::planner {
namespace {

using enum gcode::Axis;

// The next segment begins elsewhere if it begins further away than this: homing, an offset, a jump.
constexpr double kSamePlace_mm = 1e-6;

std::int64_t whole(double steps) {
  constexpr double kMost = 0x1p53;
  return marlin::saturated<std::int64_t>(std::clamp(std::round(steps), -kMost, kMost));
}

// The firmware's products in floats decide ties.
double product(double mm, double steps_per_mm) {
  return static_cast<float>(mm) * static_cast<float>(steps_per_mm);
}

std::optional<float> start_of(const std::optional<gcode::ReadingOfE>& reading) {
  return reading ? std::optional(reading->start) : std::nullopt;
}

std::optional<float> end_of(const std::optional<gcode::ReadingOfE>& reading) {
  return reading ? std::optional(reading->end) : std::nullopt;
}

}  // namespace

MarlinPlanner::MarlinPlanner(const Limits& limits, const FirmwareConfig& config)
    : Planner(limits),
      config_(config),
      settings_limits_(limits),
      settings_(marlin::make_settings(limits, config)),
      ring_(settings_.block_buffer_size) {}

bool MarlinPlanner::add(const gcode::Segment& segment) {
  if (limits_ != settings_limits_) {
    settings_ = marlin::make_settings(limits_, config_);
    settings_limits_ = limits_;
  }
  follow_jumps(segment);
  asked_mm_ = segment.end_mm;
  asked_reading_of_e_ = end_of(segment.reading_of_e);
  if (!segment.start_known) {
    start_assumed_ = segment.start_assumed && (start_known_ || start_assumed_);
    start_known_ = false;
  }

  // One entry always stays empty.
  if (end_ - first_ == ring_.size() - 1) {
    if (!running_) run_first();
    drop_first();
    run_first();
  }
  const marlin::Steps target = rounded(segment.end_mm, end_of(segment.reading_of_e));
  marlin::Request request{{},
                          static_cast<float>(segment.feed_mm_s),
                          static_cast<float>(segment.curve_radius_mm),
                          segment.reading_of_e ? segment.reading_of_e->factor : 1.0F};
  for (std::size_t axis = 0; axis < target.size(); ++axis) {
    request.delta[axis] = target[axis] - position_[axis];
  }
  const std::size_t moves_queued = end_ - first_ - (running_ ? 1 : 0);
  marlin::Block& added = block(end_);
  if (!marlin::populate_block(settings_, request, moves_queued, previous_, added)) {
    return false;
  }
  set_move(segment, target, added.move);
  position_ = target;
  filament_mm_ = segment.end_mm[E];
  start_known_ = true;
  start_assumed_ = false;
  ++end_;
  if (end_ - 1 != planned_) {
    reverse_pass();
    forward_pass();
  }
  return true;
}

void MarlinPlanner::stop() {
  while (first_ != end_) {
    if (!running_) run_first();
    drop_first();
  }
}

std::size_t MarlinPlanner::take(std::vector<PlannedMove>& out) {
  const std::size_t count = final_.size();
  out.insert(out.end(), std::make_move_iterator(final_.begin()),
             std::make_move_iterator(final_.end()));
  final_.clear();
  return count;
}

std::size_t MarlinPlanner::pending() const {
  return final_.size() + (end_ - first_) - (running_ ? 1 : 0);
}

// Without a reading E is counted from the beginning of the file, and does not fit a float.
marlin::Steps MarlinPlanner::rounded(const gcode::Position& position_mm,
                                     std::optional<float> reading_of_e) const {
  marlin::Steps result{};
  for (const auto axis : gcode::kXYZ) {
    result[axis] = whole(product(position_mm[axis], config_.steps_per_mm[axis]));
  }
  result[E] = whole(reading_of_e ? product(*reading_of_e, config_.steps_per_mm[E])
                                 : position_mm[E] * config_.steps_per_mm[E]);
  return result;
}

// An axis that does not begin where the segment before ended has been set to another place
// (set_machine_position_mm). So has E where it reads something else (set_e_position_mm).
void MarlinPlanner::follow_jumps(const gcode::Segment& segment) {
  const std::optional<float> reading = start_of(segment.reading_of_e);
  const marlin::Steps start = rounded(segment.start_mm, reading);
  for (std::size_t axis = 0; axis < start.size(); ++axis) {
    const bool jumps =
        !has_position_ || std::abs(segment.start_mm[axis] - asked_mm_[axis]) > kSamePlace_mm;
    if (jumps || (axis == E && reading != asked_reading_of_e_)) position_[axis] = start[axis];
    if (jumps && axis == E) filament_mm_ = segment.start_mm[E];
  }
  has_position_ = true;
}

// Makes the move from position_ to the target, both in whole steps.
void MarlinPlanner::set_move(const gcode::Segment& segment, const marlin::Steps& target,
                             PlannedMove& move) {
  move = PlannedMove{};
  move.segment = segment;
  move.segment.start_known = start_known_;
  move.segment.start_assumed = start_assumed_;
  std::array<double, 4> delta{};
  for (std::size_t axis = 0; axis < delta.size(); ++axis) {
    const double steps_per_mm = config_.steps_per_mm[axis];
    if (axis == E) {
      move.segment.start_mm[E] = filament_mm_;
    } else {
      move.segment.start_mm[axis] = static_cast<double>(position_[axis]) / steps_per_mm;
      move.segment.end_mm[axis] = static_cast<double>(target[axis]) / steps_per_mm;
    }
    delta[axis] = static_cast<double>(target[axis] - position_[axis]) / steps_per_mm;
  }
  if (segment.reading_of_e) delta[E] *= segment.reading_of_e->factor;
  const double xyz_mm = std::sqrt(delta[X] * delta[X] + delta[Y] * delta[Y] + delta[Z] * delta[Z]);
  move.kinematic = xyz_mm > 0.0;
  move.length_mm = move.kinematic ? xyz_mm : std::abs(delta[E]);
  for (std::size_t axis = 0; axis < delta.size(); ++axis) {
    move.direction[axis] = delta[axis] / move.length_mm;
  }
}

// The first block begins to run: its trapezoid is final, and so is the next one's entry speed
// (get_current_block).
void MarlinPlanner::run_first() {
  marlin::Block& first = block(first_);
  const float exit =
      first_ + 1 == end_ ? settings_.minimum_speed_mm_s : std::sqrt(block(first_ + 1).entry_v2);
  marlin::set_profile(marlin::make_trapezoid(first, std::sqrt(first.entry_v2), exit), first);
  final_.push_back(std::move(first.move));
  running_ = true;
  planned_ = std::max(planned_, first_ + 1);
}

void MarlinPlanner::drop_first() {
  ++first_;
  running_ = false;
}

// From the last block back to the one after planned_: sets the highest entry speeds from which the
// machine can still slow down. The firmware skips blocks that begin at their limit already. The
// result is the same, because speeds only rise here.
void MarlinPlanner::reverse_pass() {
  float next_v2 = settings_.minimum_speed_mm_s * settings_.minimum_speed_mm_s;
  for (std::size_t i = end_ - 1; i != planned_; --i) {
    marlin::Block& current = block(i);
    current.entry_v2 = current.max_entry_v2;
    if (!current.nominal_length) {
      current.entry_v2 = std::min(current.entry_v2, marlin::reachable_v2(current, next_v2));
    }
    next_v2 = current.entry_v2;
  }
}

// From planned_ on: lowers speeds that cannot be reached by accelerating. Nothing before a block
// that begins at its limit, or at full acceleration, can change any more.
void MarlinPlanner::forward_pass() {
  for (std::size_t i = planned_ + 1; i < end_; ++i) {
    const marlin::Block& before = block(i - 1);
    marlin::Block& current = block(i);
    if (!before.nominal_length && before.entry_v2 < current.entry_v2) {
      const float v2 = marlin::reachable_v2(before, before.entry_v2);
      if (v2 < current.entry_v2) {
        current.entry_v2 = v2;
        planned_ = i;
      }
    }
    if (current.entry_v2 == current.max_entry_v2) planned_ = i;
  }
}

}  // namespace unflex::planner

namespace unflex::firmware::marlin {

extern constexpr planner::FirmwarePlanner kPlanner = {
    .make = [](const planner::Limits& limits,
               const planner::FirmwareConfig& config) -> std::unique_ptr<planner::Planner> {
      return std::make_unique<planner::MarlinPlanner>(limits, config);
    },
    .as_accepted = [](planner::Limits limits) { return limits; }};

}  // namespace unflex::firmware::marlin
