// The ring of moves, and when they are frozen.
//
// Source: RepRapFirmware 3.5.3, src/Movement/DDARing.cpp: CanAddMove, Spin, PrepareMoves;
// src/Movement/DDA.h; src/Movement/Move.cpp: MoveLoop.
#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>
#include <utility>

#include "firmware_planner.hpp"
#include "rrf_dda.hpp"
#include "rrf_lookahead.hpp"
#include "unflex/planner/rrf_planner.hpp"

namespace unflex::planner {
namespace {

using enum gcode::Axis;

// How long before its start a move is frozen, in step clocks (UsualMinimumPreparedTime,
// AbsoluteMinimumPreparedTime).
std::int64_t usual_lead(std::int64_t clock_hz) { return clock_hz / 10; }
std::int64_t shortest_lead(std::int64_t clock_hz) { return clock_hz / 20; }

// A move that does not slow down cannot become better (IsGoodToPrepare).
std::int64_t lead(const rrf::Dda& dda, std::int64_t clock_hz) {
  return dda.end_speed >= dda.top_speed ? usual_lead(clock_hz) : shortest_lead(clock_hz);
}

}  // namespace

Limits rrf_raised(Limits limits) {
  constexpr double kMinSpeed_mm_s = 0.01;  // AbsoluteMinFeedrate
  constexpr double kMinJerk_mm_s = 0.1;    // MinimumJerk
  constexpr double kMinAccel_mm_s2 = 0.1;  // MinimumAcceleration
  const auto raise = [](double& value, double least) { value = std::max(value, least); };
  raise(limits.min_movement_velocity_mm_s, kMinSpeed_mm_s);
  for (const auto axis : gcode::kXYZE) {
    raise(limits.axis_max_velocity_mm_s[axis], limits.min_movement_velocity_mm_s);
    raise(limits.axis_max_accel_mm_s2[axis], kMinAccel_mm_s2);
    raise(limits.axis_max_jerk_mm_s[axis], kMinJerk_mm_s);
    raise(limits.axis_jerk_mm_s[axis], kMinJerk_mm_s);
  }
  raise(limits.print_accel_mm_s2, kMinAccel_mm_s2);
  raise(limits.travel_accel_mm_s2, kMinAccel_mm_s2);
  return limits;
}

RrfPlanner::RrfPlanner(const Limits& limits, const FirmwareConfig& config)
    : Planner(limits),
      config_(config),
      motors_(config.motors),
      settings_limits_(limits),
      settings_(rrf::make_settings(limits, config)),
      ring_length_(static_cast<std::size_t>(config.ring_length)),
      clock_hz_(std::llround(config.step_clock_hz)) {}

bool RrfPlanner::add(const gcode::Segment& segment) {
  // A line without a number is a move of its own.
  const bool same_line =
      !buffer_.empty() && segment.line != 0 && buffer_.back().line == segment.line;
  if (!same_line) empty_buffer();
  if (!rrf::moves(segment)) return false;
  buffer_.push_back(segment);
  while (!buffer_.empty() && can_add()) admit();
  return true;
}

void RrfPlanner::empty_buffer() {
  while (!buffer_.empty()) {
    wait_for_space();
    admit();
  }
}

void RrfPlanner::admit() {
  if (limits_ != settings_limits_) {
    settings_ = rrf::make_settings(limits_, config_);
    settings_limits_ = limits_;
  }
  const gcode::Segment segment = std::move(buffer_.front());
  buffer_.pop_front();
  rrf::Dda dda;
  rrf::start_dda(settings_, segment, dda);

  PlannedMove& move = dda.move;
  move.segment = segment;
  move.segment.start_mm = on_steps(segment.start_mm);
  move.segment.end_mm = on_steps(segment.end_mm);
  move.length_mm = dda.length_mm;
  move.kinematic = dda.direction[X] != 0.0F || dda.direction[Y] != 0.0F || dda.direction[Z] != 0.0F;
  for (const auto axis : gcode::kXYZE) {
    move.direction[axis] = move.segment.delta(axis) / move.length_mm;
  }
  provisional_.push_back(std::move(dda));
  rrf::join_last(settings_, provisional_, frozen_extrudes_);
  // A full ring begins to move (DDARing::Spin, waitingForSpace).
  moving_ = moving_ || !can_add();
  while (moving_ && can_freeze()) freeze();
}

void RrfPlanner::stop() {
  empty_buffer();
  while (!provisional_.empty()) freeze();
  finish_.clear();
  now_ = 0;
  moving_ = false;
}

std::size_t RrfPlanner::take(std::vector<PlannedMove>& out) {
  const std::size_t count = final_.size();
  out.insert(out.end(), std::make_move_iterator(final_.begin()),
             std::make_move_iterator(final_.end()));
  final_.clear();
  return count;
}

std::size_t RrfPlanner::pending() const {
  return final_.size() + provisional_.size() + buffer_.size();
}

// Lets time pass until the ring has room.
void RrfPlanner::wait_for_space() {
  while (!can_add()) {
    if (moving_) {
      now_ = std::max(now_, next_event());
      while (!finish_.empty() && finish_.front() <= now_) finish_.pop_front();
      // A move is added before others are frozen.
      if (can_add()) return;
    }
    while (can_freeze()) freeze();
    // The firmware lets 50 ms pass before the first move begins. Nothing happens until then, so the
    // plan is the same without this pause.
    moving_ = true;
  }
}

bool RrfPlanner::can_add() const {
  // One entry stays empty until the oldest move is frozen, because that move starts where the entry
  // before it ends.
  const std::size_t used = provisional_.size() + finish_.size();
  if (used >= ring_length_ || (used + 1 == ring_length_ && finish_.empty())) return false;
  std::int64_t total = 0;
  for (const rrf::Dda& dda : provisional_) total += dda.clocks;
  const std::int64_t after_first = provisional_.empty() ? 0 : total - provisional_.front().clocks;
  return after_first < clock_hz_ / 2 || total < 2 * clock_hz_;
}

bool RrfPlanner::can_freeze() const {
  return !provisional_.empty() && 2 * finish_.size() < ring_length_ &&
         last_finish() - now_ < lead(provisional_.front(), clock_hz_);
}

void RrfPlanner::freeze() {
  rrf::Dda& first = provisional_.front();
  rrf::finish(settings_, first);
  frozen_extrudes_ = first.direction[E] > 0.0F;
  finish_.push_back(last_finish() + first.clocks);
  final_.push_back(std::move(first.move));
  provisional_.pop_front();
}

// When the running move ends, or the next one is due to be frozen.
std::int64_t RrfPlanner::next_event() const {
  std::int64_t event = finish_.empty() ? now_ : finish_.front();
  if (!provisional_.empty() && 2 * finish_.size() < ring_length_) {
    event = std::min(event, last_finish() - lead(provisional_.front(), clock_hz_) + 1);
  }
  return event;
}

std::int64_t RrfPlanner::last_finish() const { return finish_.empty() ? now_ : finish_.back(); }

gcode::Position RrfPlanner::on_steps(const gcode::Position& position_mm) const {
  std::array<double, Motors::kCount> motors_mm{};
  for (std::size_t motor = 0; motor < motors_mm.size(); ++motor) {
    float at_mm = 0.0F;
    double exactly_at_mm = 0.0;
    for (const auto axis : gcode::kXYZ) {
      at_mm +=
          static_cast<float>(motors_.rows()[motor][axis]) * static_cast<float>(position_mm[axis]);
      exactly_at_mm += motors_.rows()[motor][axis] * position_mm[axis];
    }
    const double steps_per_mm = config_.steps_per_mm[motor];
    const float steps = at_mm * static_cast<float>(steps_per_mm);
    motors_mm[motor] =
        steps_per_mm > 0.0 ? std::rint(static_cast<double>(steps)) / steps_per_mm : exactly_at_mm;
  }
  gcode::Position result = position_mm;
  std::ranges::copy(motors_.axes(motors_mm), result.begin());
  return result;
}

}  // namespace unflex::planner

namespace unflex::firmware::rrf {

extern constexpr planner::FirmwarePlanner kPlanner = {
    .make = [](const planner::Limits& limits,
               const planner::FirmwareConfig& config) -> std::unique_ptr<planner::Planner> {
      return std::make_unique<planner::RrfPlanner>(limits, config);
    },
    .as_accepted = planner::rrf_raised};

}  // namespace unflex::firmware::rrf
