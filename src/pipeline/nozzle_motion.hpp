// What the nozzle does while the base moves as planned, exactly.
#pragma once

#include "piece_reader.hpp"
#include "unflex/dynamics/base_trajectory.hpp"
#include "unflex/dynamics/flexible_axis.hpp"
#include "unflex/planner/planner.hpp"
#include "unflex/verify/deviation.hpp"

namespace unflex::pipeline {

[[nodiscard]] dynamics::NozzleXY at_rest(const gcode::Position& position);

// On the plan, where the move ends and as fast as it then is.
[[nodiscard]] dynamics::NozzleXY at_end_of(const planner::PlannedMove& move);

// Takes the nozzle from one moment of the move to a later one, seconds after its start.
void advance(const planner::PlannedMove& move, double from_s, double to_s,
             const verify::NozzleModel& model, dynamics::NozzleXY& nozzle);

// Takes it from node k of the base's motion to the next.
void advance(const dynamics::BaseTrajectory& base, std::size_t k, const verify::NozzleModel& model,
             dynamics::NozzleXY& nozzle);

// The part of an offset that is across the segment, which moves in X or Y; without sign.
[[nodiscard]] double across_mm(const gcode::Segment& segment, double x_mm, double y_mm);

// The nozzle after the piece's own moves and pauses, starting from `nozzle`.
[[nodiscard]] dynamics::NozzleXY after_motion(const Piece& piece, dynamics::NozzleXY nozzle,
                                              const verify::NozzleModel& model);

}  // namespace unflex::pipeline
