// The setup with which the windows of a run are solved.
#pragma once

#include "unflex/compensate/run.hpp"
#include "unflex/dynamics/base_trajectory.hpp"
#include "unflex/emit/run.hpp"
#include "unflex/machine/machine.hpp"
#include "unflex/run/piece_reader.hpp"

namespace unflex::run {

// The setup of every run, from the settings alone.
[[nodiscard]] compensate::Setup compensate_setup(const machine::Settings& settings);

// How a run is solved and written.
struct RunSetup {
  compensate::Setup setup;
  emit::RunAccel accel;
  double asked_accel_mm_s2 = 0.0;  // the largest that its plan asks of X or Y, rounded
  // The acceleration that the base may have so that no motor's speed changes too much from line to
  // line. Infinite where lines end on whole steps.
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

}  // namespace unflex::run
