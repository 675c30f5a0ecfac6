// Klipper's lookahead.
//
// Notation (klippy/toolhead.py, kinematics/cartesian.py, kinematics/extruder.py):
//   v²     squared speeds; along a ramp of length L they change by Δ = 2aL
//   θ      angle between the reversed incoming and the outgoing direction; 180° when collinear
//   R      sin(θ/2) / (1 − sin(θ/2)); the circle that strays δ from the corner has radius δR
//   δ      junction deviation, v_sc²(√2 − 1)/a, so that a right angle is passed at v_sc, the
//          square-corner velocity
//   r      minimum cruise ratio; smooth ramps use (1 − r)a
//
// Backward pass, from a standstill after the last move n:
//   s_i = min(S_i, s_{i+1} + Δ_i)            speed at the start of move i, squared
//   m_i = min(M_i, m_{i+1} + (1 − r)Δ_i)     s_i with smooth ramps
// where S and M already hold the forward reach from the start of the stretch. Once m_i is bound by
// M_i, no later move can change m_i or anything before i.
#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>
#include <numbers>
#include <utility>

#include "firmware_planner.hpp"
#include "unflex/planner/klipper_planner.hpp"

namespace unflex::planner {
namespace {

// Shorter motion in X, Y and Z counts as none.
constexpr double kShortestMove_mm = 1e-9;
// Acceleration of a move of the extruder alone before the extruder's own limit.
constexpr double kUnlimitedAccel_mm_s2 = 99999999.9;
// Moves are planned lazily each time this much motion has been queued; more is gathered after a
// standstill.
constexpr double kPlanInterval_s = 0.150;
constexpr double kFirstPlanInterval_s = 1.0;

double square(double x) { return x * x; }

// Sets direction and length. False if the move has no length.
bool set_geometry(PlannedMove& move) {
  using enum gcode::Axis;
  std::array<double, 4> delta{};
  for (std::size_t axis = 0; axis < delta.size(); ++axis) {
    delta[axis] = move.segment.end_mm[axis] - move.segment.start_mm[axis];
  }
  move.length_mm = std::sqrt(square(delta[X]) + square(delta[Y]) + square(delta[Z]));
  move.kinematic = move.length_mm >= kShortestMove_mm;
  if (!move.kinematic) {
    delta = {0.0, 0.0, 0.0, delta[E]};
    move.length_mm = std::abs(delta[E]);
    if (move.length_mm == 0.0) return false;
  }
  const double inverse_length = 1.0 / move.length_mm;
  for (std::size_t axis = 0; axis < delta.size(); ++axis) {
    move.direction[axis] = delta[axis] * inverse_length;
  }
  return true;
}

// Squared speed the extruder allows at a junction: its own speed may jump by v_ic.
double extruder_junction_v2(double e_per_mm_before, double e_per_mm_after, double v_ic) {
  return square(v_ic / std::abs(e_per_mm_after - e_per_mm_before));
}

}  // namespace

KlipperPlanner::KlipperPlanner(const Limits& limits, const FirmwareConfig& config)
    : Planner(limits), config_(config), until_plan_s_(kFirstPlanInterval_s) {}

bool KlipperPlanner::add(const gcode::Segment& segment) {
  PlannedMove& move = moves_.emplace_back();
  move.segment = segment;
  if (!set_geometry(move)) {
    moves_.pop_back();
    return false;
  }
  Junction& junction = lookahead_.emplace_back();
  const double velocity =
      move.kinematic ? std::min(segment.feed_mm_s, limits_.max_velocity_mm_s) : segment.feed_mm_s;
  const double accel = limits_.max_accel_mm_s2;
  move.accel_mm_s2 = move.kinematic ? accel : kUnlimitedAccel_mm_s2;
  junction.max_cruise_v2 = square(velocity);
  junction.delta_v2 = 2.0 * move.length_mm * move.accel_mm_s2;
  junction.smooth_delta_v2 = 2.0 * move.length_mm * (accel * (1.0 - limits_.minimum_cruise_ratio));
  junction.junction_deviation_mm =
      square(limits_.square_corner_velocity_mm_s) * (std::numbers::sqrt2 - 1.0) / accel;
  limit_by_axes();

  if (lookahead_.size() == 1) return true;
  join_to_previous();
  until_plan_s_ -= move.length_mm / std::sqrt(junction.max_cruise_v2);
  if (until_plan_s_ <= 0.0) plan(/*lazy=*/true);
  return true;
}

void KlipperPlanner::stop() {
  plan(/*lazy=*/false);
  until_plan_s_ = kFirstPlanInterval_s;
}

std::size_t KlipperPlanner::take(std::vector<PlannedMove>& out) {
  const std::size_t count = moves_.size() - lookahead_.size();
  if (count == 0) return 0;
  const auto end = moves_.begin() + static_cast<std::ptrdiff_t>(count);
  out.insert(out.end(), moves_.begin(), end);
  moves_.erase(moves_.begin(), end);
  return count;
}

std::size_t KlipperPlanner::pending() const { return moves_.size(); }

// Lowers the limits of the last move. The new limits are along its path.
void KlipperPlanner::limit_speed(double velocity_mm_s, double accel_mm_s2) {
  PlannedMove& move = moves_.back();
  Junction& junction = lookahead_.back();
  junction.max_cruise_v2 = std::min(junction.max_cruise_v2, square(velocity_mm_s));
  move.accel_mm_s2 = std::min(move.accel_mm_s2, accel_mm_s2);
  junction.delta_v2 = 2.0 * move.length_mm * move.accel_mm_s2;
  junction.smooth_delta_v2 = std::min(junction.smooth_delta_v2, junction.delta_v2);
}

// Limits of single axes: Z, and the extruder where it moves alone or backwards.
void KlipperPlanner::limit_by_axes() {
  using enum gcode::Axis;
  const PlannedMove& move = moves_.back();
  const double z_per_mm = std::abs(move.direction[Z]);
  if (z_per_mm > 0.0) {
    limit_speed(config_.max_z_velocity_mm_s / z_per_mm, config_.max_z_accel_mm_s2 / z_per_mm);
  }
  const double e_per_mm = move.direction[E];
  const bool without_xy = move.direction[X] == 0.0 && move.direction[Y] == 0.0;
  if (e_per_mm < 0.0 || (e_per_mm > 0.0 && without_xy)) {
    limit_speed(config_.max_extrude_only_velocity_mm_s / std::abs(e_per_mm),
                config_.max_extrude_only_accel_mm_s2 / std::abs(e_per_mm));
  }
}

// Limits the speed between the last move and the one before it. The machine stands still where a
// move of the extruder alone begins or ends.
void KlipperPlanner::join_to_previous() {
  using enum gcode::Axis;
  const PlannedMove& move = moves_.back();
  const PlannedMove& before = moves_[moves_.size() - 2];
  if (!move.kinematic || !before.kinematic) return;
  Junction& junction = lookahead_.back();
  const Junction& junction_before = lookahead_[lookahead_.size() - 2];
  const auto& u = before.direction;
  const auto& w = move.direction;

  double v2 = std::min({junction.max_cruise_v2, junction_before.max_cruise_v2,
                        junction_before.max_start_v2 + junction_before.delta_v2});
  if (u[E] != w[E]) {
    v2 = std::min(v2, extruder_junction_v2(u[E], w[E], config_.instantaneous_corner_velocity_mm_s));
  }
  const double cos_theta = -(u[X] * w[X] + u[Y] * w[Y] + u[Z] * w[Z]);
  const double sin_half = std::sqrt(std::max(0.5 * (1.0 - cos_theta), 0.0));
  const double cos_half = std::sqrt(std::max(0.5 * (1.0 + cos_theta), 0.0));
  if (sin_half < 1.0 && cos_half > 0.0) {
    const double r = sin_half / (1.0 - sin_half);
    // The circle may touch either move no further than at its middle: v² = aL tan(θ/2)/2.
    const double quarter_tan_half = 0.25 * sin_half / cos_half;
    v2 = std::min({v2, r * junction.junction_deviation_mm * move.accel_mm_s2,
                   r * junction_before.junction_deviation_mm * before.accel_mm_s2,
                   junction.delta_v2 * quarter_tan_half,
                   junction_before.delta_v2 * quarter_tan_half});
  }
  junction.max_start_v2 = v2;
  junction.max_smooth_start_v2 =
      std::min(v2, junction_before.max_smooth_start_v2 + junction_before.smooth_delta_v2);
}

// Fills in start, end and cruise speeds as if the machine stood still after the last move, and
// returns how many moves are final. When planning lazily these are the moves before the last but
// one peak of the smooth profile, because the last peak still moves as the queue grows. Otherwise
// these are all moves.
std::size_t KlipperPlanner::backward_pass(bool lazy) {
  std::size_t final_count = lazy ? 0 : lookahead_.size();
  bool searching = lazy;
  double next_v2 = 0.0;
  double next_smooth_v2 = 0.0;
  double peak_v2 = 0.0;          // cruise speed of the nearest later peak of the smooth profile
  std::size_t decelerating = 0;  // moves up to the nearest later one that can accelerate
  for (std::size_t i = lookahead_.size(); i-- > 0;) {
    Junction& move = lookahead_[i];
    const double reach_v2 = next_v2 + move.delta_v2;
    const double smooth_reach_v2 = next_smooth_v2 + move.smooth_delta_v2;
    const double smooth_v2 = std::min(move.max_smooth_start_v2, smooth_reach_v2);
    move.start_v2 = std::min(move.max_start_v2, reach_v2);
    move.end_v2 = next_v2;
    move.cruise_v2.reset();
    ++decelerating;
    if (smooth_v2 < smooth_reach_v2) {
      if (smooth_v2 + move.smooth_delta_v2 > next_smooth_v2 || decelerating > 1) {
        if (searching && peak_v2 > 0.0) {
          final_count = i + decelerating;
          searching = false;
        }
        peak_v2 = 0.5 * (smooth_v2 + smooth_reach_v2);
      }
      move.cruise_v2 = std::min({0.5 * (move.start_v2 + reach_v2), move.max_cruise_v2, peak_v2});
      decelerating = 0;
    }
    next_v2 = move.start_v2;
    next_smooth_v2 = smooth_v2;
  }
  return final_count;
}

// Gives the first `count` moves of the lookahead their trapezoids.
void KlipperPlanner::forward_pass(std::size_t count) {
  PlannedMove* move = moves_.data() + (moves_.size() - lookahead_.size());
  double cruise_v2 = 0.0;
  for (std::size_t i = 0; i < count; ++i, ++move) {
    const Junction& junction = lookahead_[i];
    cruise_v2 = junction.cruise_v2.value_or(std::min(cruise_v2, junction.start_v2));
    const double start_v2 = std::min(junction.start_v2, cruise_v2);
    const double end_v2 = std::min(junction.end_v2, cruise_v2);
    const double accel_d = 0.5 * (cruise_v2 - start_v2) / move->accel_mm_s2;
    const double decel_d = 0.5 * (cruise_v2 - end_v2) / move->accel_mm_s2;
    const double v_s = std::sqrt(start_v2);
    const double v_c = std::sqrt(cruise_v2);
    const double v_e = std::sqrt(end_v2);
    move->start_v_mm_s = v_s;
    move->cruise_v_mm_s = v_c;
    move->end_v_mm_s = v_e;
    move->accel_s = accel_d / (0.5 * (v_s + v_c));
    move->cruise_s = std::max(move->length_mm - accel_d - decel_d, 0.0) / v_c;
    move->decel_s = decel_d / (0.5 * (v_e + v_c));
  }
}

void KlipperPlanner::plan(bool lazy) {
  until_plan_s_ = kPlanInterval_s;
  const std::size_t count = backward_pass(lazy);
  forward_pass(count);
  lookahead_.erase(lookahead_.begin(), lookahead_.begin() + static_cast<std::ptrdiff_t>(count));
}

}  // namespace unflex::planner

namespace unflex::firmware::klipper {

extern constexpr planner::FirmwarePlanner kPlanner = {
    .make = [](const planner::Limits& limits,
               const planner::FirmwareConfig& config) -> std::unique_ptr<planner::Planner> {
      return std::make_unique<planner::KlipperPlanner>(limits, config);
    },
    .as_accepted = [](planner::Limits limits) { return limits; }};

}  // namespace unflex::firmware::klipper
