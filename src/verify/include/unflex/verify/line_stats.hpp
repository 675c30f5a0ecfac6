// How wide the line of plastic is, and how far its edges are from where they should be.
#pragma once

#include <array>
#include <cstddef>

#include "unflex/dynamics/hotend_pressure.hpp"

namespace unflex::verify {

// What decides how wide a line of plastic comes out.
struct LineModel {
  // An advance of 0 is what the sliced file or the printer has set; if that is 0 as well, it is not
  // known, and no line is measured.
  dynamics::HotendPressure hotend;
  // Compensated runs set pressure advance, or do without the printer's.
  bool is_written = true;
  double width_mm = 0.45;  // of a line, for edges
};

// Length of a bin.
inline constexpr double kWidthBin_mm = 0.4;

// How much wider the line is than sliced, relative to its width, in bins. The first and
// the last millimetre of each line are left out.
struct WidthStats {
  double rms = 0.0;
  double p99 = 0.0;      // 99 % of the bins are off by less
  double largest = 0.0;  // with its sign
  double wide = 0.0;     // share of the bins that are off by more than 10 %
  std::size_t line = 0;  // of the sliced file, with the largest error
};

// The distance of the nozzle from the path, and half of what the line is too wide or too narrow.
struct EdgeStats {
  double rms_mm = 0.0;
  double p99_mm = 0.0;
  double max_mm = 0.0;
  std::size_t line = 0;
};

// How much more filament comes out at one end of the lines than is sliced there, relative to it:
// each line of at least 3 mm counts once.
struct EndStats {
  double rms = 0.0;
  double mean = 0.0;
};

// Hotends that differ from the model: pressure 20 % lower and higher, dead time 2 ms shorter (but
// not below 0) and longer.
inline constexpr std::size_t kOtherHotends = 4;

struct LineStats {
  double length_mm = 0.0;  // of the bins; 0: nothing is known of the line
  WidthStats width;
  EdgeStats edge;
  EndStats first;  // over the first millimetre of lines, and over the last one, or a little more
  EndStats last;
  std::array<WidthStats, kOtherHotends> other;
};

}  // namespace unflex::verify
