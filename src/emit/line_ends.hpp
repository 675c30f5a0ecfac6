// The times at which the lines of a run end.
#pragma once

#include <vector>

#include "unflex/dynamics/base_trajectory.hpp"
#include "unflex/emit/line_rules.hpp"
#include "vertices.hpp"

namespace unflex::emit {

// Share of the largest change of speed that the vertices may use. The rest is for the lines' times.
inline constexpr double kOfSpeedStep = 0.95;

// Whether a line over this time is long enough: rules.even_line_s(), and min_line_mm along X or Y.
[[nodiscard]] bool long_enough(const dynamics::BaseTrajectory& base, double from, double to,
                               const LineRules& rules);

// Whether speed changes by no more than it may from line to line, if as many lines as possible
// share this time evenly. Also true if not even the shortest lines could do that.
[[nodiscard]] bool cuts_well(const dynamics::BaseTrajectory& base, double from, double to,
                             const LineRules& rules);

// Appends to `times` the ends of the lines between `from` (its last entry) and `to`, `to` included.
// Lines grow as long as what they leave out moves the nozzle by no more than the tolerance. No line
// is too short, if [from, to] allows.
void append_line_ends(const dynamics::BaseTrajectory& base, double from, double to,
                      const LineRules& rules, std::vector<double>& times);

// If the nozzle is further off at the end of a line than lines within the tolerance should cause,
// halves that line and the line before it. The vertices are those at `times`. A line stays whole if
// its halves would be too short. Returns whether any line was halved.
bool split_lines(const dynamics::BaseTrajectory& base, const Axes<AxisVertices>& vertices,
                 const LineRules& rules, std::vector<double>& times);

// Halves both lines of each join at which the speed of an axis changes by more than it may. The
// vertices are those at `times`. A line stays whole if its halves would be too short. Returns
// whether any line was halved.
bool split_quick_joins(const dynamics::BaseTrajectory& base, const Axes<AxisVertices>& vertices,
                       const LineRules& rules, std::vector<double>& times);

// Halves both lines of each of these joins, the i-th being behind line i. A line stays whole if its
// halves would be too short. Returns whether any line was halved.
bool split_at_joins(const dynamics::BaseTrajectory& base, const std::vector<bool>& joins,
                    const LineRules& rules, std::vector<double>& times);

}  // namespace unflex::emit
