// The trapezoid of one move as a function of time and back.
//
// Notation:
//   v_s, v_c, v_e   speeds at the start, in the cruise and at the end      a   acceleration
//   T_a, T_c, T_d   durations of these three phases                        L   length
//   T_l             duration of the lead, at v_s            v_l     where the ramp up begins
// The decelerating phase is measured from the end of the move, so that both ends are exact.
#include <algorithm>
#include <cmath>

#include "unflex/core/math.hpp"
#include "unflex/planner/planner.hpp"

namespace unflex::planner {
namespace {

// Time to cover d from the speed v under the acceleration a: the root of a t²/2 + v t = d in the
// form without cancellation.
double time_to_cover(double d, double v, double a) {
  if (d <= 0.0) return 0.0;
  return 2.0 * d / (v + std::sqrt(v * v + 2.0 * a * d));
}

double ramp_distance(double v, double a, double t) { return t * (v + 0.5 * a * t); }

}  // namespace

std::array<Phase, 4> PlannedMove::phases() const {
  return {{{lead_s, start_v_mm_s, 0.0},
           {accel_s, ramp_v_mm_s(), ramp_up_mm_s2()},
           {cruise_s, cruise_v_mm_s, 0.0},
           {decel_s, cruise_v_mm_s, -ramp_down_mm_s2()}}};
}

double PlannedMove::distance_mm(double t) const {
  const double duration = duration_s();
  if (t <= 0.0) return 0.0;
  if (t >= duration) return length_mm;
  double d = 0.0;
  if (t < lead_s) {
    d = start_v_mm_s * t;
  } else if (t < lead_s + accel_s) {
    d = start_v_mm_s * lead_s + ramp_distance(ramp_v_mm_s(), ramp_up_mm_s2(), t - lead_s);
  } else if (t < lead_s + accel_s + cruise_s) {
    d = start_v_mm_s * lead_s + 0.5 * (ramp_v_mm_s() + cruise_v_mm_s) * accel_s +
        cruise_v_mm_s * (t - lead_s - accel_s);
  } else {
    d = length_mm - ramp_distance(end_v_mm_s, ramp_down_mm_s2(), duration - t);
  }
  return std::clamp(d, 0.0, length_mm);
}

double PlannedMove::velocity_mm_s(double t) const {
  const double duration = duration_s();
  if (t <= 0.0) return start_v_mm_s;
  if (t >= duration) return end_v_mm_s;
  if (t < lead_s) return start_v_mm_s;
  if (t < lead_s + accel_s) {
    return std::min(ramp_v_mm_s() + ramp_up_mm_s2() * (t - lead_s), cruise_v_mm_s);
  }
  if (t < lead_s + accel_s + cruise_s) return cruise_v_mm_s;
  return std::min(end_v_mm_s + ramp_down_mm_s2() * (duration - t), cruise_v_mm_s);
}

gcode::Position PlannedMove::position_mm(double t) const {
  if (t <= 0.0) return segment.start_mm;
  if (t >= duration_s()) return segment.end_mm;
  const double d = distance_mm(t);
  gcode::Position position = segment.start_mm;
  for (std::size_t axis = 0; axis < position.size(); ++axis) position[axis] += direction[axis] * d;
  return position;
}

double duration_s(std::span<const PlannedMove> moves) {
  double sum = 0.0;
  for (const PlannedMove& move : moves) {
    sum += move.duration_s();
  }
  return sum;
}

std::span<const PlannedMove> last_moves(std::span<const PlannedMove> moves, double duration_s) {
  std::size_t first = moves.size();
  for (double taken_s = 0.0; first > 0 && taken_s < duration_s;) {
    taken_s += moves[--first].duration_s();
  }
  return moves.subspan(first);
}

double PlannedMove::time_s(double distance_mm) const {
  const double duration = duration_s();
  if (distance_mm <= 0.0) return 0.0;
  if (distance_mm >= length_mm) return duration;
  const double lead_d = start_v_mm_s * lead_s;
  if (distance_mm < lead_d) return distance_mm / start_v_mm_s;
  const double accel_d = 0.5 * (ramp_v_mm_s() + cruise_v_mm_s) * accel_s;
  if (distance_mm < lead_d + accel_d) {
    return lead_s +
           std::min(time_to_cover(distance_mm - lead_d, ramp_v_mm_s(), ramp_up_mm_s2()), accel_s);
  }
  const double remaining = length_mm - distance_mm;
  if (remaining < 0.5 * (end_v_mm_s + cruise_v_mm_s) * decel_s) {
    return duration - std::min(time_to_cover(remaining, end_v_mm_s, ramp_down_mm_s2()), decel_s);
  }
  return lead_s + accel_s + std::min((distance_mm - lead_d - accel_d) / cruise_v_mm_s, cruise_s);
}

double asked_accel_mm_s2(const PlannedMove& move) {
  const double share = largest_part(xy_of(move.direction));
  return move.accel_s + move.decel_s > 0.0 ? share * move.accel_mm_s2 : 0.0;
}

bool turns_sharply(const gcode::Position& before, const gcode::Position& after) {
  constexpr double kCosine = 0.9397;
  const double lengths = length(xy_of(before)) * length(xy_of(after));
  return dot(xy_of(before), xy_of(after)) < kCosine * lengths;
}

}  // namespace unflex::planner
