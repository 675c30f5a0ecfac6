// The acceleration that the base may have so that its lines keep the limits.
#pragma once

#include "unflex/machine/machine.hpp"

namespace unflex::run {

// Whether the same motors move X and Y.
[[nodiscard]] bool shares_motors(const machine::Settings& settings);

// The acceleration that the largest change of speed from line to line allows the base. Infinite
// where lines end on whole steps.
[[nodiscard]] double accel_by_lines_mm_s2(const machine::Settings& settings);

// The shortest line that Marlin makes, along X or Y. Rounding may take a step off either end.
[[nodiscard]] double min_line_mm(const machine::Settings& settings);

// The acceleration that the base may have so that the text stays within the limits. There is a
// limit of acceleration and, if lines end on a fine grid, one of the change of speed from line to
// line. Whole steps of a motor are too coarse for the second. asked_mm_s2: the largest that the
// plan asks for. for_turns: the acceleration also lets lines follow where the base turns round.
[[nodiscard]] double planned_base_accel_mm_s2(const machine::Settings& settings, double asked_mm_s2,
                                              bool for_turns = true);

}  // namespace unflex::run
