// The settings as each stage wants them.
#pragma once

#include <string>
#include <vector>

#include "piece_reader.hpp"
#include "unflex/compensate/run.hpp"
#include "unflex/dynamics/base_trajectory.hpp"
#include "unflex/emit/emit_options.hpp"
#include "unflex/emit/run.hpp"
#include "unflex/gcode/interpreter.hpp"
#include "unflex/machine/machine.hpp"
#include "unflex/planner/planner.hpp"
#include "unflex/timing/timing.hpp"
#include "unflex/verify/verify.hpp"

namespace unflex::pipeline {

[[nodiscard]] gcode::InterpreterOptions interpreter_options(const machine::Settings& settings);
[[nodiscard]] planner::Limits planner_limits(const machine::Settings& settings);
[[nodiscard]] planner::FirmwareConfig firmware_config(const machine::Settings& settings);
[[nodiscard]] compensate::Setup compensate_setup(const machine::Settings& settings);
// The axes as they swing. Windows are solved for the axes of `dynamics` alone, without what rings
// behind them (machine::SecondSettings).
[[nodiscard]] dynamics::FlexibleAxis nozzle_x(const machine::Settings& settings);
[[nodiscard]] dynamics::FlexibleAxis nozzle_y(const machine::Settings& settings);

// How a run is solved and written.
struct RunSetup {
  compensate::Setup setup;
  emit::RunAccel accel;
  double asked_accel_mm_s2 = 0.0;  // the largest that its plan asks of X or Y, rounded
  // What the base may have so that no motor's speed changes too much from line to line; infinite
  // where lines end on whole steps.
  double accel_by_lines_mm_s2 = 0.0;
};

// The setup for one run, which begins with this nozzle.
//
// * The base may accelerate more where the plan asks for more than the printer's own limit.
// * If the travel of an axis is not known, the base stays above 0 if the run does, since many
//   machines end there.
// * If kept motion has set the nozzle swinging and the run begins to draw at once, the base stops
//   the nozzle first. It takes half a period for that.
[[nodiscard]] RunSetup setup_for(const compensate::Setup& setup, const Piece& run,
                                 const dynamics::NozzleXY& nozzle,
                                 const machine::Settings& settings);
[[nodiscard]] emit::EmitOptions emit_options(const machine::Settings& settings,
                                             std::string version);
// What each move of the run may do if its timing is free.
[[nodiscard]] std::vector<timing::MoveBounds> move_bounds(const Piece& run,
                                                          const machine::Settings& settings);
// What lays the run, and how evenly it is to lay; nullopt: its width does not count.
[[nodiscard]] std::optional<timing::Extruder> extruder_of(const Piece& run,
                                                          const emit::EmitOptions& options,
                                                          const machine::TimingSettings& timing);
[[nodiscard]] verify::Rules verify_rules(const machine::Settings& settings);

}  // namespace unflex::pipeline
