// The filament of a run as a motion of its own, E(t), and what each of its lines pushes.
//
// Notation:
//   V(t)   filament that shall have come out at time t: what belongs to the place where the
//          nozzle is
//   E(t)   filament that the lines push. Where the printer presses filament together by itself, E
//          is V, or what becomes V once the printer has smoothed it (smoothed_filament.hpp). Where
//          unflex does, E is such that V comes out of the hotend (pressure_program.hpp)
//   δ      the hotend's dead time
#pragma once

#include <optional>
#include <vector>

#include "lines_in_time.hpp"
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

// The printer's own advance while a run prints; nullopt where it stays as it is. Klipper advances
// by itself what a linear hotend needs, smoothed over less time. Otherwise it is off, and pressure
// is written into the filament.
[[nodiscard]] std::optional<planner::FirmwareAdvance> advance_in_run(
    const EmitOptions& options, const gcode::PressureAdvance& of_file);

// Whether pressure advance is written into the run.
[[nodiscard]] bool writes_pressure(const NozzleProgress& nozzle, const EmitOptions& options);

// Whether a limit keeps the filament from changing its speed faster, for each join of lines. The
// i-th join is behind line i. Shorter lines would allow a faster change.
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
