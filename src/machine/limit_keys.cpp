#include "unflex/machine/limit_keys.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <string>
#include <utility>
#include <variant>

#include "unflex/planner/limit_rows.hpp"

namespace unflex::machine {
namespace {

constexpr std::array kAxes = {'x', 'y', 'z', 'e'};

class Collector {
 public:
  explicit Collector(const gcode::LimitChange& change) : change_(&change) {
    // RepRapFirmware may have two jerks; the keys of jerk then take M566's.
    const gcode::AxisValues& most = change.axis_max_jerk_mm_s;
    sets_most_jerk_ =
        std::ranges::any_of(most, [](const auto& value) { return value.has_value(); });
  }

  void add(const planner::LimitRow& row) {
    std::visit([&](const auto& member) { add(row, member); }, row.member);
  }
  std::vector<LimitValue> take() { return std::move(values_); }

 private:
  void add(const planner::LimitRow& row, const planner::AxisLimit& member) {
    const bool is_jerk = member.change == &gcode::LimitChange::axis_jerk_mm_s;
    const gcode::AxisValues& values =
        is_jerk && sets_most_jerk_ ? change_->axis_max_jerk_mm_s : change_->*member.change;
    for (std::size_t axis = 0; axis < kAxes.size(); ++axis) {
      if (values[axis]) {
        values_.push_back({fmt::format(fmt::runtime(row.key), kAxes[axis]), *values[axis]});
      }
    }
  }
  void add(const planner::LimitRow& row, const auto& member) {
    if (const auto& value = change_->*member.change) {
      values_.push_back({std::string(row.key), static_cast<double>(*value) * row.per_unit});
    }
  }

  const gcode::LimitChange* change_;
  bool sets_most_jerk_;
  std::vector<LimitValue> values_;
};

}  // namespace

std::vector<LimitValue> limit_values(const gcode::LimitChange& change) {
  Collector collector(change);
  for (const planner::LimitRow& row : planner::limit_rows()) {
    if (!row.key.empty()) {
      collector.add(row);
    }
  }
  return collector.take();
}

}  // namespace unflex::machine
