#include "run_check.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "rounding.hpp"

namespace unflex::verify {

void Excursion::add(const gcode::Segment& segment) {
  if (segment.start_known) {
    add(segment.start_mm, segment.line);
  }
  add(segment.end_mm, segment.line);
}

void Excursion::add(const gcode::Position& at, std::size_t line) {
  const XY place_mm = xy_of(at);
  for_each_axis(
      [&](const TravelRange& travel, double at_mm, std::array<Side, 2>& sides) {
        const std::array<double, 2> beyond_mm = {travel.min_mm - at_mm, at_mm - travel.max_mm};
        for (std::size_t side = 0; side < sides.size(); ++side) {
          if (beyond_mm[side] > sides[side].beyond_mm) {
            sides[side] = {beyond_mm[side], line, place_mm};
          }
        }
      },
      *travel_, place_mm, sides_);
}

const Excursion::Side* Excursion::worse_than(const Excursion& input) const {
  const Side* worse = nullptr;
  for_each_axis(
      [&](const TravelRange& travel, const std::array<Side, 2>& sides,
          const std::array<Side, 2>& input_sides) {
        for (std::size_t side = 0; side < sides.size(); ++side) {
          const bool is_assumed = side == 0 && travel.min_assumed;
          if (worse == nullptr && !(is_assumed && input_sides[side].beyond_mm > 0.0) &&
              sides[side].beyond_mm > input_sides[side].beyond_mm + kRounding_mm) {
            worse = &sides[side];
          }
        }
      },
      *travel_, sides_, input.sides_);
  return worse;
}

void BaseCheck::Largest::offer(double a_value, std::size_t a_line) {
  if (a_value > value) {
    value = a_value;
    line = a_line;
  }
}

void BaseCheck::begin_run() {
  end_velocity_ = {};
  last_duration_s_ = 0.0;
  velocity_ = {};
  accel_ = {};
  asked_accel_ = 0.0;
}

void BaseCheck::go_on(const planner::PlannedMove& before) {
  begin_run();
  if (before.duration_s() > 0.0) {
    keep(before);
  }
}

BaseCheck::PerMotor BaseCheck::of_motors(const gcode::Position& axes) const {
  PerMotor result{};
  for (std::size_t i = 0; i < result.size(); ++i) {
    result[i] = motors_.moves_xy(i) ? motors_.of(i, axes) : 0.0;
  }
  return result;
}

BaseCheck::PerMotor BaseCheck::mean_velocity(const planner::PlannedMove& move) const {
  const double duration = move.duration_s();
  gcode::Position mean_mm_s{};
  for (std::size_t axis = 0; axis < mean_mm_s.size(); ++axis) {
    mean_mm_s[axis] = (move.segment.end_mm[axis] - move.segment.start_mm[axis]) / duration;
  }
  return of_motors(mean_mm_s);
}

BaseCheck::PerMotor BaseCheck::velocity_at(const planner::PlannedMove& move, double v_mm_s) const {
  gcode::Position of_axes_mm_s{};
  for (std::size_t axis = 0; axis < of_axes_mm_s.size(); ++axis) {
    of_axes_mm_s[axis] = v_mm_s * move.direction[axis];
  }
  return of_motors(of_axes_mm_s);
}

void BaseCheck::add(const planner::PlannedMove& move) {
  const double duration = move.duration_s();
  if (duration <= 0.0) {
    return;
  }
  const gcode::Segment& segment = move.segment;
  const PerMotor velocity = mean_velocity(move);
  for (std::size_t motor = 0; motor < velocity.size(); ++motor) {
    const double v = std::abs(velocity[motor]);
    max_velocity_ = std::max(max_velocity_, v);
    velocity_.offer(v - motors_.uncertainty(motor) * kRounding_mm / duration, segment.line);
  }
  // The firmware may pass from kept motion into the run, and out of the run, at some speed.
  if (last_duration_s_ == 0.0) {
    last_velocity_ = velocity_at(move, move.start_v_mm_s);
    join(last_velocity_);
  }
  change_of_velocity(velocity, duration, segment.line);
  keep(move);
  durations_s_.add_square(duration * duration, 1.0);
}

void BaseCheck::add_kept(const planner::PlannedMove& move) {
  if (is_beside_run_) {
    join(velocity_at(move, move.start_v_mm_s));
  }
  is_beside_run_ = false;
  joined_velocity_ = velocity_at(move, move.end_v_mm_s);
}

void BaseCheck::join(const PerMotor& velocity) {
  for (std::size_t motor = 0; motor < velocity.size(); ++motor) {
    max_step_ = std::max(max_step_, std::abs(velocity[motor] - joined_velocity_[motor]));
  }
}

void BaseCheck::keep(const planner::PlannedMove& move) {
  last_velocity_ = mean_velocity(move);
  end_velocity_ = velocity_at(move, move.end_v_mm_s);
  last_duration_s_ = move.duration_s();
  last_line_ = move.segment.line;
}

void BaseCheck::change_of_velocity(const PerMotor& velocity, double duration_s, std::size_t line) {
  const double between_s = 0.5 * (last_duration_s_ + duration_s);
  if (between_s <= 0.0) {
    return;
  }
  const auto uncertainty = [](double move_s) { return move_s > 0.0 ? kRounding_mm / move_s : 0.0; };
  const double uncertain = (uncertainty(last_duration_s_) + uncertainty(duration_s)) / between_s;
  for (std::size_t motor = 0; motor < velocity.size(); ++motor) {
    const double step = std::abs(velocity[motor] - last_velocity_[motor]);
    max_step_ = std::max(max_step_, step);
    const double accel = step / between_s;
    max_accel_ = std::max(max_accel_, accel);
    accel_.offer(accel - motors_.uncertainty(motor) * uncertain, line);
  }
}

void BaseCheck::end_run() {
  change_of_velocity(end_velocity_, 0.0, last_line_);
  is_beside_run_ = true;
  joined_velocity_ = end_velocity_;
  largest_accel_limit_ = std::max(largest_accel_limit_, accel_limit_mm_s2());
  report(velocity_, "velocity", "mm/s", rules_->base_max_velocity_mm_s);
  report(accel_, "acceleration", "mm/s²", accel_limit_mm_s2());
}

void BaseCheck::report(const Largest& largest, std::string_view what, std::string_view unit,
                       double limit) {
  if (largest.value > (1.0 + kLimitTolerance) * limit) {
    violations_->in_output(largest.line, fmt::format("base {} {:.4g} {} is above the limit {:.4g}",
                                                     what, largest.value, unit, limit));
  }
}

double BaseCheck::accel_limit_mm_s2() const {
  return std::max(rules_->base_max_accel_mm_s2, rules_->base_accel_times_plan * asked_accel_);
}

void BaseCheck::add_planned(const planner::PlannedMove& move) {
  asked_accel_ = std::max(asked_accel_, planner::asked_accel_mm_s2(move));
}

double BaseCheck::median_duration_s() const { return durations_s_.quantile(0.5); }

std::optional<std::string> broken_rule(const std::vector<planner::PlannedMove>& reference,
                                       const std::vector<planner::PlannedMove>& base,
                                       const Rules& rules, const planner::PlannedMove* before) {
  Violations violations("", "");
  Excursion allowed(rules.travel);
  BaseCheck check(rules, violations);
  before != nullptr ? check.go_on(*before) : check.begin_run();
  bool too_much_before = false;
  for (const planner::PlannedMove& move : reference) {
    check.add_planned(move);
    allowed.add(move.segment);
    too_much_before = too_much_before || move.segment.too_much_filament;
  }
  Excursion excursion(rules.travel);
  StepGauge steps(rules.fixed, rules.steps);
  for (const planner::PlannedMove& move : base) {
    check.add(move);
    steps.play(move);
    excursion.add(move.segment);
    if (move.segment.too_much_filament && !too_much_before) {
      return "so much filament is too much for so short a way";
    }
  }
  check.end_run();
  if (const Excursion::Side* const side = excursion.worse_than(allowed)) {
    return fmt::format("the base would leave the travel by {:.4f} mm", side->beyond_mm);
  }
  const std::vector<StepBreach> breaches = steps.breaches();
  if (!breaches.empty()) {
    return breaches.front().message;
  }
  const std::vector<Violation> found = violations.take();
  return found.empty() ? std::nullopt : std::optional(found.front().message);
}

}  // namespace unflex::verify
