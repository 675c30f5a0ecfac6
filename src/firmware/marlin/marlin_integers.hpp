// Numbers of the firmware, and how its 32-bit processors convert them (ARM, VCVT).
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>

namespace unflex::planner::marlin {

// Steps per second of a block that begins at rest (stepper.h, MINIMAL_STEP_RATE).
inline constexpr std::uint32_t kMinRate = 120;

// Rounds towards zero. A value that the type cannot hold becomes the nearest that it can, and NaN
// becomes 0.
template <class Integer>
[[nodiscard]] Integer saturated(double value) {
  using Range = std::numeric_limits<Integer>;
  if (std::isnan(value)) {
    return 0;
  }
  if (value <= static_cast<double>(Range::min())) {
    return Range::min();
  }
  return value >= static_cast<double>(Range::max()) ? Range::max() : static_cast<Integer>(value);
}

[[nodiscard]] inline std::uint32_t to_unsigned(double value) {
  return saturated<std::uint32_t>(value);
}

}  // namespace unflex::planner::marlin
