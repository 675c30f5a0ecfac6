// A table of every limit that a file can set: the member that holds it, and its names in the
// settings and in messages.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string_view>
#include <variant>

#include "unflex/gcode/interpreter.hpp"
#include "unflex/planner/planner.hpp"

namespace unflex::planner {

// A limit that all motion shares.
struct SharedLimit {
  double Limits::*in_force;
  std::optional<double> gcode::LimitChange::*change;
};

// A limit of each axis.
struct AxisLimit {
  std::array<double, 4> Limits::*in_force;
  gcode::AxisValues gcode::LimitChange::*change;
};

// A limit that is one of a few numbers.
struct ChoiceLimit {
  int Limits::*in_force;
  std::optional<int> gcode::LimitChange::*change;
};

struct LimitRow {
  std::variant<SharedLimit, AxisLimit, ChoiceLimit> member;
  std::string_view key;   // in the settings, with {} for the axis; empty: it has none of its own
  std::string_view word;  // in messages, with {} for the axis
  double per_unit = 1.0;  // of the key's unit in one of the member's
};

// Rows of axes stand together, so that differences can be told axis by axis.
[[nodiscard]] std::span<const LimitRow> limit_rows();

}  // namespace unflex::planner
