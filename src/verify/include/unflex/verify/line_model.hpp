// The settings that decide how wide a line of plastic comes out.
#pragma once

#include "unflex/dynamics/hotend_pressure.hpp"

namespace unflex::verify {

struct LineModel {
  // An advance of 0 stands for the one that the sliced file or the printer has set. If that is 0 as
  // well, the advance is not known, and no line is measured.
  dynamics::HotendPressure hotend;
  // Compensated runs set pressure advance, or do without the printer's.
  bool is_written = true;
  double width_mm = 0.45;  // of a line, for edges
};

}  // namespace unflex::verify
