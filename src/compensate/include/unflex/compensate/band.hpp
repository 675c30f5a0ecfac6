// Makes plants of a band. The band is the set of possible axes while frequencies and damping ratios
// are not known exactly.
#pragma once

#include <vector>

#include "unflex/compensate/axis_window.hpp"
#include "unflex/dynamics/flexible_axis.hpp"

namespace unflex::compensate {

// The share by which each frequency and each damping ratio may be off, either way. 0: exact.
struct Band {
  double freq_error = 0.0;
  double damping_error = 0.0;

  [[nodiscard]] bool is_exact() const { return freq_error <= 0.0 && damping_error <= 0.0; }
};

// The axis with a second mode that nobody has measured, and its share. Most axes have such a mode.
// A base that suits this plant, too, does not move at such frequencies more than it must. The axis
// must have one mode.
[[nodiscard]] Plant with_unknown_mode(const dynamics::FlexibleAxis& axis);

// The edges of the band around the axis: two, or four if both may be off; none if it is exact. The
// shares of the edges and of the middle, which is the axis itself, add up to `share`.
[[nodiscard]] std::vector<Plant> edges(const dynamics::FlexibleAxis& axis, const Band& band,
                                       double share);

}  // namespace unflex::compensate
