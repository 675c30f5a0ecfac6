// The filament of a run as a motion of its own, E(t), and what each of its lines pushes.
//
// Notation:
//   V(t)   filament that shall have come out at time t: what belongs to the place where the nozzle
//   is E(t)   filament that the extruder has pushed. Where the printer's own pressure advance is
//   left
//          on, E = V, and the printer adds the rest. Where it is written, E is such that V comes
//          out of the hotend (pressure_program.hpp)
//   δ      the hotend's dead time
#pragma once

#include <vector>

#include "nozzle_progress.hpp"
#include "strokes.hpp"
#include "timetable.hpp"

namespace unflex::emit {

// The filament of a run's moves, mm.
struct RunFilament {
  double all_mm = 0.0;  // of all of them
  // Marlin may still owe filament of a move it skipped. The first line lays it, or draws it back.
  double behind_mm = 0.0;
};

// Lines to be: when they begin, and when the last one ends; and how long each of them is.
struct LinesInTime {
  std::vector<double> times_s;
  std::vector<double> lengths_mm;
};

// Whether pressure advance is written into the run.
[[nodiscard]] bool writes_pressure(const NozzleProgress& nozzle, const EmitOptions& options);

// At which joins of the lines, the i-th being behind line i, the filament would change its speed
// faster if it might. Shorter lines would let it.
[[nodiscard]] std::vector<bool> joins_at_limit(const NozzleProgress& nozzle,
                                               const LinesInTime& lines,
                                               const EmitOptions& options);

// Gives the strokes their filament. ends_s: when each of them ends, since the start of the run's
// motion. laying: how many of them, from the first on, lay the run's filament.
void lay_filament(const Run& run, const Timetable& table, const NozzleProgress& nozzle,
                  const RunFilament& filament, const gcode::Position& start_mm,
                  const std::vector<double>& ends_s, std::size_t laying, const EmitOptions& options,
                  std::vector<Stroke>& strokes);

}  // namespace unflex::emit
