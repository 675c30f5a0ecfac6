// The lines of a run in time, before they have their filament.
#pragma once

#include <vector>

namespace unflex::emit {

// When n lines begin, and when the last one ends (n + 1 times); and how long each of them is.
struct LinesInTime {
  std::vector<double> times_s;
  std::vector<double> lengths_mm;
};

}  // namespace unflex::emit
