// Places for the moves of a test.
#pragma once

#include <fmt/core.h>

#include <optional>
#include <string_view>

#include "unflex/core/error.hpp"
#include "unflex/machine/machine.hpp"

namespace unflex::machine {

// Above whatever homing leaves on the bed.
inline constexpr double kTestHeight_mm = 10.0;
// If the size of the bed is not known, we assume that it is at least this large.
inline constexpr double kSmallBed_mm = 100.0;

// Where a test begins along an axis, if it is `length_mm` long and in the middle.
[[nodiscard]] inline Result<double> begin_of(const std::optional<Range>& travel, double length_mm,
                                             std::string_view key) {
  const Range range = travel.value_or(Range{0.0, kSmallBed_mm});
  if (range.max - range.min < length_mm) {
    return fail(ErrorKind::usage, fmt::format("{} leaves no {} mm for the test's moves; it says "
                                              "where the tool may be",
                                              key, length_mm));
  }
  return (range.min + range.max - length_mm) / 2.0;
}

}  // namespace unflex::machine
