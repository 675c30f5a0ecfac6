// The limits that commands set, under the names of the settings.
#pragma once

#include <string>
#include <vector>

#include "unflex/gcode/interpreter.hpp"

namespace unflex::machine {

struct LimitValue {
  std::string key;  // "limits.max_x_accel_mm_s2"
  double value = 0.0;
};

// Every limit that the change sets.
[[nodiscard]] std::vector<LimitValue> limit_values(const gcode::LimitChange& change);

}  // namespace unflex::machine
