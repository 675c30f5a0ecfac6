// RepRapFirmware: one move's limits and its trapezoid.
#pragma once

#include "unflex/planner/rrf_planner.hpp"

namespace unflex::planner::rrf {

[[nodiscard]] Settings make_settings(const Limits& limits, const FirmwareConfig& config);

// Whether the firmware makes a move of the segment (InitStandardMove, 2).
[[nodiscard]] bool moves(const gcode::Segment& segment);

// Direction, length, accelerations and requested speed of a segment that moves, from standstill to
// standstill (InitStandardMove, up to its lookahead).
void start_dda(const Settings& settings, const gcode::Segment& segment, Dda& dda);

// The trapezoid between start_speed and end_speed, and the duration (RecalculateMove).
void set_trapezoid(Dda& dda);

// Puts the trapezoid into dda.move, and the duration that the move really takes into dda.clocks
// (Prepare).
void finish(const Settings& settings, Dda& dda);

// v_e of a ramp over the length: v² = v_s² + 2as.
[[nodiscard]] float speed_after(float start_speed, float accel, float length_mm);

}  // namespace unflex::planner::rrf
