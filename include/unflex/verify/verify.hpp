// The judge: replays an emitted file by the firmware's rules and measures it against its input.
// Shares no code with the optimiser or the emitter.
#pragma once

#include <istream>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "unflex/core/error.hpp"
#include "unflex/core/progress.hpp"
#include "unflex/gcode/interpreter.hpp"
#include "unflex/planner/planner.hpp"
#include "unflex/verify/deviation.hpp"
#include "unflex/verify/observer.hpp"

namespace unflex::verify {

struct TravelLimits {
  double x_min_mm = -1e9;
  double x_max_mm = 1e9;
  double y_min_mm = -1e9;
  double y_max_mm = 1e9;
  // The minimum of an axis is not known but taken to be 0 wherever the sliced path stays above it.
  bool x_min_assumed = false;
  bool y_min_assumed = false;
};

// By how much the nozzle may stray more in a compensated run than if that had been kept, by
// whichever is more. There is a little for the steps in which the two are sampled.
struct Leeway {
  double times = 1.02;
  double rms_mm = 0.5e-3;
  double max_mm = 3e-3;
};

struct Rules {
  gcode::InterpreterOptions interpreter;
  planner::Limits limits;
  planner::FirmwareConfig fixed;
  double max_extrude_ratio = 0.266080;  // mm of filament per mm of path a firmware accepts
  double nozzle_diameter_mm = 0.4;
  NozzleModel nozzle;
  TravelLimits travel;
  double base_max_velocity_mm_s = 600.0;
  double base_max_accel_mm_s2 = 20000.0;
  double max_lines_per_s = std::numeric_limits<double>::infinity();
  Leeway leeway;
  double lead_in_s = 0.0;  // by which compensated runs start before their plan
};

// One broken rule of the emitted file.
struct Violation {
  SourcePlace place;
  std::string message;
};

// A compensated run that broke a rule, or after which one was found broken, by its lines in the
// sliced file.
struct BlamedRun {
  std::size_t first_line = 0;
  std::size_t last_line = 0;
  std::string reason;  // the first
};

// What another nozzle on the same two bases does.
struct Detuned {
  Deviation uncompensated;
  Deviation compensated;
};

// By how much of the path the nozzle and the filament that comes out are apart, while the reference
// lays filament: as if the filament of one place of the sliced path came out at another.
struct LagStats {
  double rms_mm = 0.0;  // by time
  double max_mm = 0.0;
  std::size_t max_line = 0;  // of the sliced file
};

struct VerifyReport {
  // Measured against the firmware's plan of the input.
  Deviation uncompensated;
  // In compensated runs, which begin and end at rest, measured against the plan of the run by
  // itself; where the input passes from one stretch into the next at speed, that takes some ms
  // longer.
  Deviation compensated;
  std::vector<Detuned> detuned;   // one for each of Observation::detuned
  double reference_time_s = 0.0;  // duration of the input by the firmware's plan, dwells included
  double emitted_time_s = 0.0;    // of the output
  // Of the replayed base, largest motor of X and Y, compensated runs only: mean velocity of one
  // move.
  double base_max_velocity_mm_s = 0.0;
  // Of the replayed base, the same motors, compensated runs only: change of mean velocity between
  // neighbouring moves over the time between their middles.
  double base_max_accel_mm_s2 = 0.0;
  double input_extrusion_mm = 0.0;  // net filament
  double output_extrusion_mm = 0.0;
  // Of one move or one run of the input; what the resolution of the output's lines in time may
  // explain is no error.
  double worst_move_extrusion_error_mm = 0.0;
  LagStats uncompensated_lag;
  LagStats compensated_lag;
  // Longest lag or lead of the nozzle behind the plan of its run, averaged over 0.1 s.
  double worst_run_drift_s = 0.0;
  double max_lines_per_s = 0.0;    // most lines begun in any 100 ms of the output, × 10
  double segment_ms_median = 0.0;  // of the output's moves inside compensated runs
  std::size_t runs = 0;            // compensated ones
  std::size_t output_lines = 0;
  std::size_t output_bytes = 0;
  std::vector<Violation> violations;   // at most 100 are kept …
  std::size_t violation_count = 0;     // … all are counted
  std::vector<BlamedRun> blamed_runs;  // in order; empty where nothing was compensated before
};

// The first hard rule that `base`, the replayed moves of one compensated run, breaks: the base's
// velocity and acceleration, the travel (where `reference`, the run's own plan, does not go as far
// itself), filament that the firmware refuses. nullopt when it keeps them all. before: of a part of
// a run, the last replayed move before it.
[[nodiscard]] std::optional<std::string> broken_rule(
    const std::vector<planner::PlannedMove>& reference,
    const std::vector<planner::PlannedMove>& base, const Rules& rules,
    const planner::PlannedMove* before = nullptr);

// Replays both texts and compares them. Errors: unreadable input. A file that breaks a rule is no
// error but a report with violations: a line lost, changed or moved; filament not conserved; a
// position outside the travel (and further out than the input itself goes); base velocity or
// acceleration above its limit (by more than 0.1 % and than the rounding of coordinates explains);
// more lines per second than the budget and than the sliced file has there; a base further from
// the path than the machine bends; filament laid after the plan of a run has ended; a nozzle that
// strays more than in the sliced file; a move the firmware refuses (extrusion ratio); limits, modes
// or shaper not restored. Where the sequence of stops differs, nothing can be compared any further;
// the figures are then of what came before. Nothing but VerifyReport::detuned depends on the
// observation.
[[nodiscard]] Result<VerifyReport> verify(std::istream& input, const std::string& input_name,
                                          std::istream& output, const std::string& output_name,
                                          const Rules& rules, Progress& progress,
                                          const Observation& observation = {});

}  // namespace unflex::verify
