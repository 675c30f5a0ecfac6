#include "unflex/planner/planner.hpp"

#include <algorithm>

#include "unflex/planner/klipper_planner.hpp"
#include "unflex/planner/marlin_planner.hpp"
#include "unflex/planner/rrf_planner.hpp"

namespace unflex::planner {
namespace {

template <class Value, class New>
void put(const New& value, Value& target) {
  if (value) {
    target = *value;
  }
}

void put(const gcode::AxisValues& values, std::array<double, 4>& target) {
  for (std::size_t axis = 0; axis < target.size(); ++axis) {
    put(values[axis], target[axis]);
  }
}

}  // namespace

void apply(const gcode::LimitChange& change, Limits& limits) {
  put(change.max_velocity_mm_s, limits.max_velocity_mm_s);
  put(change.max_accel_mm_s2, limits.max_accel_mm_s2);
  put(change.square_corner_velocity_mm_s, limits.square_corner_velocity_mm_s);
  put(change.minimum_cruise_ratio, limits.minimum_cruise_ratio);
  put(change.accel_to_decel_mm_s2, limits.accel_to_decel_mm_s2);
  put(change.axis_max_velocity_mm_s, limits.axis_max_velocity_mm_s);
  put(change.axis_max_accel_mm_s2, limits.axis_max_accel_mm_s2);
  put(change.axis_max_jerk_mm_s, limits.axis_max_jerk_mm_s);
  put(change.axis_jerk_mm_s, limits.axis_jerk_mm_s);
  for (std::size_t axis = 0; axis < limits.axis_jerk_mm_s.size(); ++axis) {
    limits.axis_jerk_mm_s[axis] =
        std::min(limits.axis_jerk_mm_s[axis], limits.axis_max_jerk_mm_s[axis]);
  }
  put(change.print_accel_mm_s2, limits.print_accel_mm_s2);
  put(change.travel_accel_mm_s2, limits.travel_accel_mm_s2);
  put(change.retract_accel_mm_s2, limits.retract_accel_mm_s2);
  put(change.junction_deviation_mm, limits.junction_deviation_mm);
  put(change.min_velocity_mm_s, limits.min_velocity_mm_s);
  put(change.min_travel_velocity_mm_s, limits.min_travel_velocity_mm_s);
  put(change.min_segment_time_s, limits.min_segment_time_s);
  put(change.min_movement_velocity_mm_s, limits.min_movement_velocity_mm_s);
  put(change.jerk_policy, limits.jerk_policy);
}

std::unique_ptr<Planner> make_planner(const Limits& limits, const FirmwareConfig& config) {
  if (config.firmware == Firmware::marlin) return std::make_unique<MarlinPlanner>(limits, config);
  if (config.firmware == Firmware::rrf) return std::make_unique<RrfPlanner>(limits, config);
  return std::make_unique<KlipperPlanner>(limits, config);
}

}  // namespace unflex::planner
