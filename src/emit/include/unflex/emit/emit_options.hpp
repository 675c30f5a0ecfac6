// Facts of the printer that the emitter needs, and options for writing.
#pragma once

#include <optional>
#include <string>

#include "unflex/dynamics/hotend_pressure.hpp"
#include "unflex/emit/line_rules.hpp"
#include "unflex/gcode/interpreter.hpp"
#include "unflex/planner/planner.hpp"
#include "unflex/planner/printer_shaper.hpp"

namespace unflex::emit {

// Settings for pressing filament together for the hotend in a run.
struct PressureWriting {
  // Whether unflex presses filament together. Otherwise the printer's own pressure advance stays as
  // it is.
  bool is_written = false;
  // Klipper with a linear hotend: Klipper's own advance presses filament together, smoothed over
  // less time.
  bool printer_presses = false;
  // An advance of 0 stands for the advance that the file or the printer's configuration has set.
  dynamics::HotendPressure hotend = {};
  double max_accel_mm_s2 = 10000.0;  // of filament, that the extruder can follow
};

struct EmitOptions {
  gcode::InterpreterOptions interpreter;
  planner::Limits printer_limits;  // in force when the file starts
  planner::FirmwareConfig fixed;
  planner::Limits run_limits;     // inside a compensated run
  double line_accel_mm_s2 = 1e6;  // acceleration of a line inside a run
  LineRules lines;
  PressureWriting pressure;
  // The printer's own advance while a run prints; nullopt: as it is. Set for each run.
  std::optional<planner::FirmwareAdvance> run_advance = {};
  std::string version;  // for the comment at the first run
  // Runs need not last as long as sliced.
  bool has_free_timing = false;
  // Klipper: UNFLEX_CHECKPOINT is called where a run begins and ends and where the printer's own
  // shaper is back, so that a pause inside the run takes effect at its end (docs/pausing.md).
  bool checkpoints = false;
};

// The hotend of a run. An advance of 0 is replaced by the advance that the file or the printer has
// set.
[[nodiscard]] dynamics::HotendPressure hotend_of(const EmitOptions& options,
                                                 const gcode::PressureAdvance& of_file);

}  // namespace unflex::emit
