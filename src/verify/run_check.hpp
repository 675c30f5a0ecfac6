// Checks the motion of the base in the runs against what the machine's motors can do.
//
// Notation, for neighbouring moves 1 and 2 of the emitted file, per motor that moves X or Y:
//   Δ, T   travel and duration        v̄ = Δ/T
//   a = (v̄₂ − v̄₁) / ((T₁ + T₂)/2); before the first and after the last move the base rests: T/2
//   q      rounding step of coordinates, times the axes that the motor moves: Δ is uncertain by q,
//          a by q (1/T₁ + 1/T₂) / ((T₁ + T₂)/2)
#pragma once

#include <array>
#include <cstddef>
#include <string_view>
#include <vector>

#include "unflex/core/xy.hpp"
#include "unflex/verify/log_histogram.hpp"
#include "unflex/verify/verify.hpp"
#include "violations.hpp"

namespace unflex::verify {

// The furthest a file goes beyond the travel on each side in one section, and where.
class Excursion {
 public:
  explicit Excursion(const TravelLimits& travel) : travel_(&travel) {}
  void add(const gcode::Segment& segment);
  void clear() { sides_ = {}; }

  // The point furthest beyond one side of the travel.
  struct Side {
    double beyond_mm = 0.0;
    std::size_t line = 0;
    XY place_mm;
  };
  // A side on which this file, the emitted one, goes out of the travel, and further than the
  // sliced file (`input`) does in this section; nullptr if there is none.
  [[nodiscard]] const Side* worse_than(const Excursion& input) const;

 private:
  void add(const gcode::Position& at, std::size_t line);

  const TravelLimits* travel_;
  // Below the least place and above the largest, for each axis.
  Axes<std::array<Side, 2>> sides_{};
};

// Velocity and acceleration of the base in compensated runs.
class BaseCheck {
 public:
  BaseCheck(const Rules& rules, Violations& violations)
      : rules_(&rules), violations_(&violations), motors_(rules.fixed.motors) {}

  void begin_run();
  // Begins in the middle of a run, after the move `before`.
  void go_on(const planner::PlannedMove& before);
  // A move of the run's plan, which limits the acceleration.
  void add_planned(const planner::PlannedMove& move);
  void add(const planner::PlannedMove& move);
  void end_run();
  // A move between runs. Its step of speed counts where the move meets a run.
  void add_kept(const planner::PlannedMove& move);

  // The limit of a motor's acceleration, by the acceleration that the run's plan has asked for so
  // far.
  [[nodiscard]] double accel_limit_mm_s2() const;
  // The largest limit of all runs.
  [[nodiscard]] double largest_accel_limit_mm_s2() const { return largest_accel_limit_; }
  [[nodiscard]] double max_velocity_mm_s() const { return max_velocity_; }
  [[nodiscard]] double max_accel_mm_s2() const { return max_accel_; }
  [[nodiscard]] double max_step_mm_s() const { return max_step_; }
  [[nodiscard]] double median_duration_s() const;

 private:
  // The largest value in the current run.
  struct Largest {
    double value = 0.0;
    std::size_t line = 0;
    void offer(double a_value, std::size_t a_line);
  };
  using PerMotor = std::array<double, Motors::kCount>;
  // Motion of each motor for a motion of the axes; 0 for motors that move neither X nor Y.
  [[nodiscard]] PerMotor of_motors(const gcode::Position& axes) const;
  [[nodiscard]] PerMotor mean_velocity(const planner::PlannedMove& move) const;
  // Velocity of each motor where the move has this speed along its path.
  [[nodiscard]] PerMotor velocity_at(const planner::PlannedMove& move, double v_mm_s) const;
  void keep(const planner::PlannedMove& move);
  void change_of_velocity(const PerMotor& velocity, double duration_s, std::size_t line);
  // Kept motion and a run meet, and the later of them begins with this velocity.
  void join(const PerMotor& velocity);
  void report(const Largest& largest, std::string_view what, std::string_view unit, double limit);

  const Rules* rules_;
  Violations* violations_;
  Motors motors_;
  PerMotor last_velocity_{};      // mean over the last move
  PerMotor end_velocity_{};       // at the end of the last move
  PerMotor joined_velocity_{};    // at the end of the motion that the next run or kept move meets
  bool is_beside_run_ = false;    // whether that motion is a run
  double last_duration_s_ = 0.0;  // duration of the last move; 0: at rest
  std::size_t last_line_ = 0;
  // Without what rounding may have added.
  Largest velocity_;
  Largest accel_;
  double asked_accel_ = 0.0;  // by the run's plan
  double max_velocity_ = 0.0;
  double max_accel_ = 0.0;
  double max_step_ = 0.0;
  double largest_accel_limit_ = 0.0;
  LogHistogram durations_s_;  // every move counts as one
};

}  // namespace unflex::verify
