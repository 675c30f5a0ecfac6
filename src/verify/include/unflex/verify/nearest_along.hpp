// The place of a straight way that is nearest to a point p. Verification has its own formula, since
// it must not repeat a mistake of the code that it checks (unflex/core/foot.hpp).
//
// Notation:
//   a   the way's start      d   the vector along it
//   u   how far along the way the place is: u = (p − a)·d / |d|, held in a range
#pragma once

#include <algorithm>

#include "unflex/core/xy.hpp"

namespace unflex::verify {

// u, for a d of any length. from_start_mm: p − a.
[[nodiscard]] inline double nearest_along_mm(const XY& from_start_mm, const XY& way,
                                             double way_length, double least_mm, double most_mm) {
  return std::clamp(dot(from_start_mm, way) / way_length, least_mm, most_mm);
}
// u in [0, length_mm], for |d| = 1.
[[nodiscard]] inline double nearest_along_mm(const XY& from_start_mm, const XY& direction,
                                             double length_mm) {
  return nearest_along_mm(from_start_mm, direction, 1.0, 0.0, length_mm);
}

// |p − a − u d|², for |d| = 1.
[[nodiscard]] inline double distance2_mm2(const XY& from_start_mm, const XY& direction,
                                          double along_mm) {
  return squared(from_start_mm - along_mm * direction);
}

}  // namespace unflex::verify
