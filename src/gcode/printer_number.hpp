// Numbers that a printer can take.
#pragma once

#include <cmath>

namespace unflex::gcode {

// Firmwares keep numbers in 32 bits. What is beyond them is a mistake and no number here, so that
// nothing reckoned from it, however often, is infinite; what is next to nothing is nothing.
[[nodiscard]] inline bool fits_printers(double value) {
  constexpr double kLargest = 1e10;
  return std::abs(value) <= kLargest;
}
[[nodiscard]] inline double as_printers_take_it(double value) {
  constexpr double kSmallest = 1e-10;
  return std::abs(value) < kSmallest ? 0.0 : value;
}

}  // namespace unflex::gcode
