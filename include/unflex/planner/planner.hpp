// Velocity planning with lookahead, as the firmware does it.
//
// Notation (Klipper's klippy/toolhead.py, "Move" and "LookAheadQueue"):
//   v_s, v_c, v_e   speed at the start, in the cruise and at the end of a move, mm/s
//   a               acceleration of both ramps, mm/s²
//   T_a, T_c, T_d   durations of acceleration, cruise and deceleration, s
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "unflex/gcode/interpreter.hpp"

namespace unflex::planner {

// Limits a file may change in its middle.
struct Limits {
  double max_velocity_mm_s = 300.0;
  double max_accel_mm_s2 = 5000.0;
  double square_corner_velocity_mm_s = 5.0;
  double minimum_cruise_ratio = 0.5;
};

// Puts the limits that the change sets in place of those in force.
void apply(const gcode::LimitChange& change, Limits& limits);

// Limits only the firmware's configuration sets. Defaults are Klipper's for a 0.4 mm nozzle, 1.75
// mm filament, max_velocity 300 and max_accel 5000.
struct FixedLimits {
  double max_z_velocity_mm_s = 300.0;
  double max_z_accel_mm_s2 = 5000.0;
  double max_extrude_only_velocity_mm_s = 79.8243241107433;
  double max_extrude_only_accel_mm_s2 = 1330.40540184572;
  double instantaneous_corner_velocity_mm_s = 1.0;
};

// A segment with its trapezoid.
struct PlannedMove {
  gcode::Segment segment;
  std::array<double, 4> direction{};  // per axis X Y Z E: travel per mm of length
  double length_mm = 0.0;             // in X, Y and Z; of filament when nothing else moves
  bool kinematic = true;              // moves X, Y or Z
  double start_v_mm_s = 0.0;
  double cruise_v_mm_s = 0.0;
  double end_v_mm_s = 0.0;
  double accel_mm_s2 = 0.0;
  double accel_s = 0.0;
  double cruise_s = 0.0;
  double decel_s = 0.0;

  [[nodiscard]] double duration_s() const { return accel_s + cruise_s + decel_s; }
  // Distance covered t seconds after the start of the move; t is clamped to the move.
  [[nodiscard]] double distance_mm(double t) const;
  [[nodiscard]] double velocity_mm_s(double t) const;
  // X, Y, Z, E at t seconds after the start of the move; exact at both ends.
  [[nodiscard]] gcode::Position position_mm(double t) const;
  // Time after the start at which the distance is covered; the inverse of distance_mm.
  [[nodiscard]] double time_s(double distance_mm) const;
};

// Klipper's planner: junction speeds by square-corner velocity, approximated centripetal speed and
// the extruder's instantaneous corner velocity; forward and backward pass; minimum cruise ratio.
// Moves come out in order once nothing that follows can change them. The plan does not depend on
// when, or how often, take() is called.
class KlipperPlanner {
 public:
  KlipperPlanner(Limits limits, FixedLimits fixed);

  // Limits for the moves added from now on.
  void apply(const gcode::LimitChange& change);
  [[nodiscard]] const Limits& limits() const { return limits_; }

  // Queues a segment, whose feed must be above zero. False, and nothing queued, if it has no length
  // at all.
  bool add(const gcode::Segment& segment);

  // The machine comes to rest after the last queued move.
  void stop();

  // Moves the moves that are final to the end of `out` and returns how many. After stop() these
  // are all moves queued before it.
  std::size_t take(std::vector<PlannedMove>& out);

  // Moves queued and not yet taken.
  [[nodiscard]] std::size_t pending() const;

 private:
  // What the lookahead keeps of a queued move. Speeds are squared, mm²/s², because v² changes
  // linearly along a ramp. "Smooth" is the same motion at the lower acceleration that
  // minimum_cruise_ratio leaves, (1 − ratio)·a.
  struct Junction {
    double max_start_v2 = 0.0;         // at the start: the junction's limit, or what is reachable
    double max_smooth_start_v2 = 0.0;  // the same with smooth acceleration
    double max_cruise_v2 = 0.0;
    double delta_v2 = 0.0;  // 2aL: the most by which v² can change within the move
    double smooth_delta_v2 = 0.0;
    double junction_deviation_mm = 0.0;
    // Written by the backward pass. No cruise speed: that of the move before is carried over.
    double start_v2 = 0.0;
    double end_v2 = 0.0;
    std::optional<double> cruise_v2;
  };

  void limit_speed(double velocity_mm_s, double accel_mm_s2);
  void limit_by_axes();
  void join_to_previous();
  std::size_t backward_pass(bool lazy);
  void forward_pass(std::size_t count);
  void plan(bool lazy);

  Limits limits_;
  FixedLimits fixed_;
  std::vector<PlannedMove> moves_;   // final ones first, then those in lookahead_
  std::vector<Junction> lookahead_;  // of the last lookahead_.size() entries of moves_
  double until_plan_s_;  // shortest time of moves still to be queued before the next lazy planning
};

}  // namespace unflex::planner
