// Lines that tell how long the print takes: M73, and what slicers write into comments.
#pragma once

#include <string>
#include <string_view>

namespace unflex::gcode {

// The line (without its ending) with every duration in it multiplied by `factor`: minutes in M73 R
// S C D, `;TIME:` and `;TIME_ELAPSED:` (Cura), `; estimated printing time (…) = 1h 2m 3s`
// (PrusaSlicer, SuperSlicer), `; total estimated time: 2m 3s` (OrcaSlicer, Bambu Studio). Each
// duration keeps its number of digits. Any other line, and one with a checksum, comes back as it
// is.
[[nodiscard]] std::string with_times_scaled(std::string_view line, double factor);

// Whether the lines are equal, or differ in nothing but such durations.
[[nodiscard]] bool same_but_for_times(std::string_view a, std::string_view b);

}  // namespace unflex::gcode
