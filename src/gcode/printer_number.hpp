// Numbers that a printer can take.
#pragma once

#include <cmath>
#include <optional>

namespace unflex::gcode {

// Firmwares keep numbers in 32 bits. What is beyond them is a mistake and no number here, so that
// nothing reckoned from it, however often, is infinite; what is next to nothing is nothing.
[[nodiscard]] inline std::optional<double> as_printers_take_it(std::optional<double> value) {
  constexpr double kLargest = 1e10;
  constexpr double kSmallest = 1e-10;
  if (!value || std::abs(*value) > kLargest) {
    return std::nullopt;
  }
  return std::abs(*value) < kSmallest ? 0.0 : value;
}

}  // namespace unflex::gcode
