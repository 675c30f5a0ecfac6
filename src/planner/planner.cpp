#include "unflex/planner/planner.hpp"

#include <algorithm>

#include "firmware_planner.hpp"
#include "unflex/planner/limit_rows.hpp"

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
  for (const LimitRow& row : limit_rows()) {
    std::visit([&](const auto& member) { put(change.*member.change, limits.*member.in_force); },
               row.member);
  }
  for (std::size_t axis = 0; axis < limits.axis_jerk_mm_s.size(); ++axis) {
    limits.axis_jerk_mm_s[axis] =
        std::min(limits.axis_jerk_mm_s[axis], limits.axis_max_jerk_mm_s[axis]);
  }
}

Limits as_accepted(Firmware firmware, const Limits& limits) {
  return UNFLEX_TABLE_OF(firmware, kPlanner).as_accepted(limits);
}

std::unique_ptr<Planner> make_planner(const Limits& limits, const FirmwareConfig& config) {
  return UNFLEX_TABLE_OF(config.firmware, kPlanner).make(limits, config);
}

}  // namespace unflex::planner
