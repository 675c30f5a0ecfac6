#include "unflex/machine/limit_keys.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <optional>

namespace unflex::machine {
namespace {

constexpr std::array kAxes = {'x', 'y', 'z', 'e'};

class Collector {
 public:
  void add(std::string key, std::optional<double> value, double scale = 1.0) {
    if (value) {
      values.push_back({std::move(key), *value * scale});
    }
  }

  // name: with {} for the axis.
  void add(std::string_view name, const gcode::AxisValues& of_axes) {
    for (std::size_t axis = 0; axis < kAxes.size(); ++axis) {
      add(fmt::format(fmt::runtime(name), kAxes[axis]), of_axes[axis]);
    }
  }

  std::vector<LimitValue> values;
};

}  // namespace

std::vector<LimitValue> limit_values(const gcode::LimitChange& change) {
  constexpr double kMsPerSecond = 1e3;
  Collector c;
  c.add("limits.max_velocity_mm_s", change.max_velocity_mm_s);
  c.add("limits.max_accel_mm_s2", change.max_accel_mm_s2);
  c.add("limits.square_corner_velocity_mm_s", change.square_corner_velocity_mm_s);
  c.add("limits.minimum_cruise_ratio", change.minimum_cruise_ratio);
  c.add("limits.max_{}_velocity_mm_s", change.axis_max_velocity_mm_s);
  c.add("limits.max_{}_accel_mm_s2", change.axis_max_accel_mm_s2);
  // RepRapFirmware may have two jerks; these keys then take M566's.
  const bool is_max = std::ranges::any_of(change.axis_max_jerk_mm_s,
                                          [](const auto& value) { return value.has_value(); });
  c.add("limits.jerk_{}_mm_s", is_max ? change.axis_max_jerk_mm_s : change.axis_jerk_mm_s);
  c.add("limits.print_accel_mm_s2", change.print_accel_mm_s2);
  c.add("limits.travel_accel_mm_s2", change.travel_accel_mm_s2);
  c.add("limits.retract_accel_mm_s2", change.retract_accel_mm_s2);
  c.add("limits.junction_deviation_mm", change.junction_deviation_mm);
  c.add("limits.min_velocity_mm_s", change.min_velocity_mm_s);
  c.add("limits.min_travel_velocity_mm_s", change.min_travel_velocity_mm_s);
  c.add("limits.min_segment_time_ms", change.min_segment_time_s, kMsPerSecond);
  c.add("limits.min_movement_velocity_mm_s", change.min_movement_velocity_mm_s);
  if (change.jerk_policy) {
    c.add("limits.jerk_policy", static_cast<double>(*change.jerk_policy));
  }
  return std::move(c.values);
}

}  // namespace unflex::machine
