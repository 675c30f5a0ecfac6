// Source: RepRapFirmware 3.5.3, src/Movement/DDA.cpp: InitStandardMove (its last part),
// DoLookahead, MatchSpeeds, IsDecelerationMove.
#include <algorithm>
#include <cmath>

#include "rrf_dda.hpp"
#include "rrf_lookahead.hpp"

namespace unflex::planner::rrf {
namespace {

// Jerk policy 0 joins moves of one kind only: printing, travel, or filament without printing.
bool may_join(const Settings& settings, const Dda& previous, const Dda& next) {
  return settings.join_all ||
         (next.prints == previous.prints && next.moves_xy == previous.moves_xy &&
          next.extruder_not_print == previous.extruder_not_print);
}

// Whether the joint between these moves may change when a joint further on has changed. A printing
// move may also be followed, at the same speed, by one that does not extrude: slicers' "coast to
// end".
bool may_change_previous(const Settings& settings, const Dda& previous, const Dda& dda) {
  if (settings.join_all) return true;
  if (previous.moves_xy != dda.moves_xy) return false;
  return previous.prints == dda.prints ||
         (previous.prints && previous.requested_speed == dda.requested_speed);
}

// Rounding may have left a short acceleration in a move that was meant to decelerate only.
bool only_decelerates(const Dda& dda) {
  return dda.decel_distance_mm == dda.length_mm ||
         (dda.top_speed < dda.requested_speed && dda.decel_distance_mm > 0.98F * dda.length_mm);
}

// Lowers the speed of the joint until no motor's speed changes by more than its jerk.
void limit_jerk(const Settings& settings, const Dda& next, Dda& dda) {
  for (std::size_t axis = 0; axis < dda.direction.size(); ++axis) {
    const float change = std::abs(dda.direction[axis] - next.direction[axis]);
    if (change * dda.target_end_speed > settings.allowed_jerk[axis]) {
      dda.target_end_speed = settings.allowed_jerk[axis] / change;
    }
  }
}

// One joint of the way back: decides at which speed moves[i] can end. True if the move before must
// end faster for this. The target of that move is then set.
bool look_back(const Settings& settings, std::deque<Dda>& moves, std::size_t i,
               bool frozen_extrudes) {
  Dda& dda = moves[i];
  dda.target_end_speed = std::min(dda.target_end_speed, dda.requested_speed);
  if (dda.top_speed < dda.requested_speed) {
    const bool slows_before = i > 0 ? moves[i - 1].decel_distance_mm > 0.0F : frozen_extrudes;
    const bool slows_on = only_decelerates(dda) && slows_before;
    if (i > 0 && slows_on && may_change_previous(settings, moves[i - 1], dda)) {
      limit_jerk(settings, moves[i + 1], dda);
      moves[i - 1].target_end_speed = std::min(
          speed_after(dda.target_end_speed, dda.decel, dda.length_mm), dda.requested_speed);
      return true;
    }
    const float accel = slows_on ? dda.decel : dda.accel;
    dda.target_end_speed =
        std::min(dda.target_end_speed, speed_after(dda.start_speed, accel, dda.length_mm));
  }
  limit_jerk(settings, moves[i + 1], dda);
  return false;
}

// A joint never becomes slower: the moves before it may rely on its speed.
void settle(Dda& dda) {
  dda.end_speed = std::max(dda.end_speed, dda.target_end_speed);
  set_trapezoid(dda);
}

// Lets moves[last] end as fast as its target, or as fast as the moves before it allow.
void raise_end_speed(const Settings& settings, std::deque<Dda>& moves, std::size_t last,
                     bool frozen_extrudes) {
  std::size_t i = last;
  while (look_back(settings, moves, i, frozen_extrudes)) --i;
  settle(moves[i]);
  while (i < last) {
    ++i;
    Dda& dda = moves[i];
    dda.start_speed = moves[i - 1].end_speed;
    dda.target_end_speed =
        std::min(dda.target_end_speed, speed_after(dda.start_speed, dda.accel, dda.length_mm));
    settle(dda);
  }
}

}  // namespace

void join_last(const Settings& settings, std::deque<Dda>& provisional, bool frozen_extrudes) {
  Dda& added = provisional.back();
  if (provisional.size() > 1) {
    const std::size_t last = provisional.size() - 2;
    Dda& previous = provisional[last];
    if (may_join(settings, previous, added)) {
      // The new move ends at a standstill, so it can begin at most this fast.
      previous.target_end_speed =
          std::min(std::sqrt(added.decel * added.length_mm * 2.0F), added.requested_speed);
      raise_end_speed(settings, provisional, last, frozen_extrudes);
      added.start_speed = previous.end_speed;
    }
  }
  set_trapezoid(added);
}

}  // namespace unflex::planner::rrf
