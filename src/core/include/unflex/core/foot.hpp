// The place of a straight way that is nearest to a point p.
//
//   u   how far along the way, from its start a: u = (p − a)·d / |d|², held in [0, length]
//
//   d   the way's direction, of length 1 unless 1/|d|² is given
#pragma once

#include <algorithm>

#include "unflex/core/xy.hpp"

namespace unflex {

struct Foot {
  double along_mm = 0.0;       // u
  double distance2_mm2 = 0.0;  // |p − a − u d|²
};

// from_start_mm: p − a.
[[nodiscard]] inline Foot foot_at(const XY& from_start_mm, const XY& direction, double along_mm) {
  return {along_mm, squared(from_start_mm - along_mm * direction)};
}
[[nodiscard]] inline Foot foot_on(const XY& from_start_mm, const XY& direction, double length_mm,
                                  double inverse_square = 1.0) {
  return foot_at(from_start_mm, direction,
                 std::clamp(dot(from_start_mm, direction) * inverse_square, 0.0, length_mm));
}

}  // namespace unflex
