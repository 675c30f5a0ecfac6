// Sums up the moves that leave the printer's travel in one warning, since a print that was sliced
// for another bed has thousands of them.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>

#include "unflex/core/error.hpp"
#include "unflex/gcode/interpreter.hpp"
#include "unflex/verify/verify.hpp"

namespace unflex::run {

class TravelCheck {
 public:
  explicit TravelCheck(const verify::TravelLimits& limits);

  void add(const gcode::Event& event);
  // The warning about all moves added; nullopt if none leaves the travel.
  [[nodiscard]] std::optional<Diagnostic> warning(const std::string& file) const;

 private:
  struct Side {
    verify::TravelRange limit;
    double under_mm = 0.0;  // how far moves go beyond either end
    double over_mm = 0.0;
    [[nodiscard]] bool add(double at_mm);
    [[nodiscard]] bool is_left() const;
    [[nodiscard]] double furthest_mm() const;
  };

  Axes<Side> sides_;
  std::size_t moves_ = 0;
  std::size_t first_line_ = 0;
};

}  // namespace unflex::run
