// The judge: replays an emitted file by the firmware's rules and measures it against its input.
// Shares no code with the optimiser or the emitter.
#pragma once

#include <istream>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "unflex/core/axes.hpp"
#include "unflex/core/error.hpp"
#include "unflex/core/progress.hpp"
#include "unflex/gcode/interpreter.hpp"
#include "unflex/planner/planner.hpp"
#include "unflex/verify/corners.hpp"
#include "unflex/verify/deviation.hpp"
#include "unflex/verify/line_model.hpp"
#include "unflex/verify/machine_change.hpp"
#include "unflex/verify/measured.hpp"
#include "unflex/verify/observer.hpp"
#include "unflex/verify/step_rates.hpp"

namespace unflex::verify {

// How far an axis goes.
struct TravelRange {
  double min_mm = -1e9;
  double max_mm = 1e9;
  // The minimum is not known. It is taken to be 0 in sections whose sliced path stays above 0.
  bool min_assumed = false;
};
using TravelLimits = Axes<TravelRange>;

// How far the nozzle may stray in a compensated run: `times` as far as in the run with its sliced
// moves kept, or as far as the absolute limit, whichever is more. The small margins cover the
// different sampling of the two runs.
struct Leeway {
  double times = 1.02;
  double rms_mm = 0.5e-3;
  double max_mm = 3e-3;
  // An additional distance where the firmware rounds to steps, since a single place may be off by
  // chance.
  double chance_mm = 0.0;
};

// Where the timing is free, the nozzle may at its worst stray this many times the tolerance.
inline constexpr double kTimesTolerance = 1.1;

// What is special about one tool of a tool changer.
struct ToolModel {
  int number = 0;
  NozzleModel nozzle;
  std::vector<NozzleModel> plants;  // as many as Rules::plants
  MachineChange change;
};

struct Rules {
  gcode::InterpreterOptions interpreter;
  planner::Limits limits;
  planner::FirmwareConfig fixed;
  NozzleModel nozzle;
  std::vector<NozzleModel> plants;  // what else the axes may be
  MachineChange change;
  // Each tool with a model of its own. Another tool, and the machine before the first line that
  // selects one, if 0 is not among these, have the models above.
  std::vector<ToolModel> tools;
  TravelLimits travel;
  double base_max_velocity_mm_s = 600.0;
  // Limits of the acceleration of a run's motors: a fixed one, and one as a multiple of the plan's
  // acceleration. The larger limit counts.
  double base_max_accel_mm_s2 = 20000.0;
  double base_accel_times_plan = 0.0;
  double max_lines_per_s = std::numeric_limits<double>::infinity();
  // The step rates that a compensated run may ask for. Sliced motion that asks for more breaks no
  // rule (VerifyReport::sliced_step_breaches).
  StepRules steps;
  LineModel line;
  double filament_area_mm2 = 2.405281875467;  // cross-section; here of 1.75 mm
  // The most that the hotend melts. It breaks no rule to ask for more
  // (VerifyReport::too_much_flow).
  double max_flow_mm3_s = std::numeric_limits<double>::infinity();
  // Whether the output may ask for a temperature earlier than the sliced file.
  bool may_ask_ahead = false;
  Leeway leeway;
  // How far the nozzle may stray in a run whose timing is not as sliced. 0: all runs are timed as
  // sliced.
  double tolerance_mm = 0.0;
  // The emitted file has an Interpreter::approach wherever unflex would write one. A file that
  // unflex has not written has none.
  bool approaches = true;
};

// One broken rule of the emitted file.
struct Violation {
  SourcePlace place;
  std::string message;
};

// A compensated run that is blamed for a broken rule: the rule broke in the run, or after it and
// before the next one. The lines are those of the sliced file.
struct BlamedRun {
  std::size_t first_line = 0;
  std::size_t last_line = 0;
  std::string reason;  // message of the first violation
};

// Deviations of a further nozzle (Observation::detuned) on the two bases: RMS, largest and
// duration. The other figures are 0.
struct Detuned {
  Deviation uncompensated;
  // The nozzle of Measured::unshaped. Set only if an observer asks for it.
  std::optional<Deviation> unshaped;
  Deviation compensated;
};

// A place where the output's flow exceeds Rules::max_flow_mm3_s and the sliced file's flow in the
// same section, by more than 1 % each.
struct TooMuchFlow {
  double flow_mm3_s = 0.0;
  double sliced_mm3_s = 0.0;
  std::size_t line = 0;  // of the output
};

// A line of the output that tells how long the print takes, and the time of the print up to the
// line.
struct TimeNote {
  std::size_t line = 0;
  double reference_s = 0.0;
  double emitted_s = 0.0;
};

struct VerifyReport {
  Measured measured;
  std::vector<Detuned> detuned;              // one for each of Observation::detuned
  std::optional<TooMuchFlow> too_much_flow;  // where the flow is largest
  StepRates sliced_steps;                    // lines of the sliced file
  StepRates emitted_steps;                   // lines of the output
  std::vector<StepBreach> sliced_step_breaches;
  std::size_t runs = 0;                // number of compensated runs
  std::vector<Violation> violations;   // the first 100 at most
  std::size_t violation_count = 0;     // number of all violations
  std::vector<BlamedRun> blamed_runs;  // in the order of the file
  std::vector<TimeNote> time_notes;    // in the order of the file
};

// The first hard rule that is broken by `base`, the replayed moves of one compensated run; nullopt
// if none is. The rules: velocity, acceleration and steps of the base; the travel, unless
// `reference` (the run's own plan) goes as far; no filament that the firmware refuses. before: the
// last replayed move before `base`, if `base` is a part of a run.
[[nodiscard]] std::optional<std::string> broken_rule(
    const std::vector<planner::PlannedMove>& reference,
    const std::vector<planner::PlannedMove>& base, const Rules& rules,
    const planner::PlannedMove* before = nullptr);

// Replays both texts and compares them. Errors: unreadable input. A file that breaks a rule is no
// error but a report with violations: a line lost, changed or moved; filament not conserved; a
// position outside the travel (and further out than the input itself goes); base velocity or
// acceleration above its limit (by more than 0.1 % and than the rounding of coordinates explains);
// more steps per second in a compensated run than its motors may make; more lines per second than
// the budget and than the sliced file has there; a base further from the path than the machine
// bends; filament laid after the plan of a run has ended; a nozzle that strays more than in the
// sliced file; a move the firmware refuses (extrusion ratio); limits, modes or shaper not restored.
// If the sequence of stops differs, nothing can be compared any further. The figures then cover the
// part before. Nothing but VerifyReport::detuned depends on the observation.
[[nodiscard]] Result<VerifyReport> verify(std::istream& input, const std::string& input_name,
                                          std::istream& output, const std::string& output_name,
                                          const Rules& rules, Progress& progress,
                                          const Observation& observation = {});

}  // namespace unflex::verify
