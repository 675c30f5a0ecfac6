// Lines that tell how long the print takes: M73, and what slicers write into comments.
#pragma once

#include <string>
#include <string_view>

namespace unflex::gcode {

// Factors by which the print takes longer than the slicer thinks.
struct TimeFactors {
  double whole = 1.0;  // the print
  double gone = 1.0;   // from its beginning to the line
  double left = 1.0;   // from the line to its end

  static TimeFactors even(double factor) { return {factor, factor, factor}; }
};

// The line (without its ending) with every duration in it multiplied by its factor. Durations that
// are left: minutes in M73 R S C D. A duration that is gone: `;TIME_ELAPSED:` (Cura). Durations of
// the whole print: `;TIME:` (Cura), `; estimated printing time (…) = 1h 2m 3s` (PrusaSlicer,
// SuperSlicer), `; total estimated time: 2m 3s` (OrcaSlicer, Bambu Studio). Each duration keeps its
// number of digits. Any other line, and a line with a checksum, comes back as it is.
[[nodiscard]] std::string with_times_scaled(std::string_view line, const TimeFactors& factors);

// Whether the line has a duration above 0 that with_times_scaled() would scale.
[[nodiscard]] bool tells_time(std::string_view line);

// Whether the lines are equal, or differ only in durations that with_times_scaled() would scale.
[[nodiscard]] bool same_but_for_times(std::string_view a, std::string_view b);

}  // namespace unflex::gcode
