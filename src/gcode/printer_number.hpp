// Numbers that a printer can take.
#pragma once

#include <cmath>

namespace unflex::gcode {

// Firmwares keep numbers in 32 bits. A number beyond their range is a mistake and is refused, so
// that nothing computed from it becomes infinite. A number next to zero counts as zero.
[[nodiscard]] inline bool fits_printers(double value) {
  constexpr double kLargest = 1e10;
  return std::abs(value) <= kLargest;
}
[[nodiscard]] inline double as_printers_take_it(double value) {
  constexpr double kSmallest = 1e-10;
  return std::abs(value) < kSmallest ? 0.0 : value;
}

}  // namespace unflex::gcode
