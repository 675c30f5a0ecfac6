// The band that an axis is in whose frequencies and damping ratios are known to some share, as
// plants.
#pragma once

#include <vector>

#include "unflex/compensate/axis_window.hpp"
#include "unflex/dynamics/flexible_axis.hpp"

namespace unflex::compensate {

// By which share of itself each may be off, either way. 0: it is exact.
struct Band {
  double freq_error = 0.0;
  double damping_error = 0.0;

  [[nodiscard]] bool is_exact() const { return freq_error <= 0.0 && damping_error <= 0.0; }
};

// Most axes have a second mode that whoever gives one frequency does not know. A base that suits
// this one, too, does not move at such frequencies more than it must. axis: of one mode.
[[nodiscard]] Plant with_unknown_mode(const dynamics::FlexibleAxis& axis);

// The edges of the band around the axis; none if it is exact. Their shares and that of the middle,
// the axis itself, add up to `share`.
[[nodiscard]] std::vector<Plant> edges(const dynamics::FlexibleAxis& axis, const Band& band,
                                       double share);

}  // namespace unflex::compensate
