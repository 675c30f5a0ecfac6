// The moves of the emitted file, with the filament that comes out of the nozzle meanwhile.
//
// Where pressure advance is written into a run, the extruder pushes other filament than the nozzle
// lays. In such a run the filament that comes out is measured (PressedFilament), move by move.
// Elsewhere the printer's own pressure advance is taken to make the two the same.
#pragma once

#include "pressed_filament.hpp"
#include "unflex/planner/planner.hpp"

namespace unflex::verify {

struct OutputMove {
  planner::PlannedMove pushed;  // as the file has it
  planner::PlannedMove laid;    // with the filament that comes out
};

class OutputFilament {
 public:
  // A run begins that pushes filament for this hotend.
  void begin_written(const dynamics::HotendPressure& hotend);
  // From now on each move lays as much filament as it pushes.
  void begin_plain() { is_written_ = false; }
  [[nodiscard]] OutputMove laid(planner::PlannedMove move);

 private:
  bool is_written_ = false;
  PressedFilament hotend_;
  double owed_mm_ = 0.0;  // came out, but is too little to count
};

}  // namespace unflex::verify
