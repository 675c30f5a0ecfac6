#include "unflex/planner/planner.hpp"

#include <algorithm>

namespace unflex::firmware {

// The planner of each firmware, in its folder in src/firmware.
#define UNFLEX_FIRMWARE(name)                                                            \
  namespace name {                                                                       \
  std::unique_ptr<planner::Planner> make_planner(const planner::Limits& limits,          \
                                                 const planner::FirmwareConfig& config); \
  planner::Limits as_accepted(planner::Limits limits);                                   \
  }
UNFLEX_FIRMWARES(UNFLEX_FIRMWARE)
#undef UNFLEX_FIRMWARE

}  // namespace unflex::firmware

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

Limits as_accepted(Firmware firmware, const Limits& limits) {
  using Acceptance = Limits (*)(Limits);
#define UNFLEX_FIRMWARE(name) &firmware::name::as_accepted,
  static constexpr Acceptance kAcceptances[] = {UNFLEX_FIRMWARES(UNFLEX_FIRMWARE)};
#undef UNFLEX_FIRMWARE
  return kAcceptances[static_cast<std::size_t>(firmware)](limits);
}

std::unique_ptr<Planner> make_planner(const Limits& limits, const FirmwareConfig& config) {
  using Maker = std::unique_ptr<Planner> (*)(const Limits&, const FirmwareConfig&);
#define UNFLEX_FIRMWARE(name) &firmware::name::make_planner,
  static constexpr Maker kMakers[] = {UNFLEX_FIRMWARES(UNFLEX_FIRMWARE)};
#undef UNFLEX_FIRMWARE
  return kMakers[static_cast<std::size_t>(config.firmware)](limits, config);
}

}  // namespace unflex::planner
