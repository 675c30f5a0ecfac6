#include "unflex/planner/planner.hpp"

#include <algorithm>

#include "unflex/planner/limit_rows.hpp"

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
