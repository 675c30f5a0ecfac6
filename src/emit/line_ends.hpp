// Which moments the lines of a run end at.
#pragma once

#include <vector>

#include "unflex/dynamics/base_trajectory.hpp"
#include "unflex/emit/line_rules.hpp"

namespace unflex::emit {

// What the places of lines may take of the largest change of speed; the rest is for their times.
inline constexpr double kOfSpeedStep = 0.95;

// Whether the firmware takes a line over this time: min_line_s, and min_line_mm along X or Y.
[[nodiscard]] bool long_enough(const dynamics::BaseTrajectory& base, double from, double to,
                               const LineRules& rules);

// Whether as many lines as possible between these times, all alike, can each bear what the base
// changes its speed by meanwhile.
[[nodiscard]] bool cuts_well(const dynamics::BaseTrajectory& base, double from, double to,
                             const LineRules& rules);

// Appends to `times` the ends of the lines between `from` (its last entry) and `to`, `to` included.
// Lines grow as long as what they leave out moves the nozzle by no more than the tolerance. None is
// too short, if [from, to] allows.
void append_line_ends(const dynamics::BaseTrajectory& base, double from, double to,
                      const LineRules& rules, std::vector<double>& times);

// Halves the lines before whose ends the nozzle, by errors at `times`, is off by more than is to be
// expected of lines within the tolerance, and the lines before those, as far as the halves are long
// enough. Whether there were any.
bool split_lines(const dynamics::BaseTrajectory& base, const std::vector<double>& x_error_mm,
                 const std::vector<double>& y_error_mm, const LineRules& rules,
                 std::vector<double>& times);

// Halves both lines of each join at which the speed of an axis, with the vertices x_mm and y_mm at
// `times`, changes by more than it may, as far as the halves are long enough. Whether there were
// any.
bool split_quick_joins(const dynamics::BaseTrajectory& base, const std::vector<double>& x_mm,
                       const std::vector<double>& y_mm, const LineRules& rules,
                       std::vector<double>& times);

}  // namespace unflex::emit
