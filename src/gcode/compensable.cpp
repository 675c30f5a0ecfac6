#include "unflex/gcode/compensable.hpp"

#include <algorithm>
#include <cmath>

namespace unflex::gcode {
namespace {

// Machine positions of filament are running sums of thousands of mm; an E word that repeats the
// last one can leave a difference of their last digits.
constexpr double kFilamentRoundoff_mm = 1e-9;

}  // namespace

std::string_view kept_reason(const Segment& segment) {
  if (!segment.start_known) {
    return "start unknown";
  }
  const double length_xy = segment.length_xy_mm();
  if (length_xy == 0.0) {
    return segment.delta(Z) == 0.0 ? "extrude only" : "Z move";
  }
  if (segment.delta(E) < -kFilamentRoundoff_mm) {
    return "retracting move";
  }
  return std::abs(segment.delta(Z)) <= kMaxSlope * length_xy ? "" : "Z move";
}

bool compensable(const Segment& segment) { return kept_reason(segment).empty(); }

bool compensable(const Event& event) {
  return event.kind == EventKind::move && !event.segments.empty() &&
         std::all_of(event.segments.begin(), event.segments.end(),
                     [](const Segment& segment) { return compensable(segment); });
}

}  // namespace unflex::gcode
