// The flow of filament from line to line. The firmware slows down where it jumps.
//
// Notation:
//   q, d, T   filament, length and time of a line      r = q/d, v = d/T
//   Δr        change of r where two lines join
#pragma once

#include <span>

#include "strokes.hpp"

namespace unflex::emit {

// The largest jump of the flow, mm of filament per s, at which the firmware does not slow down:
// Klipper passes a joint at no more than instantaneous_corner_velocity / |Δr|
// (kinematics/extruder.py, calc_junction). For the other firmwares it is infinite, as their limits
// of E are raised in a run.
[[nodiscard]] double most_flow_step_mm_s(const planner::FirmwareConfig& firmware);

// The acceleration of filament in lines that draw it back, mm/s²: Klipper takes such lines for
// retractions (kinematics/extruder.py, check_move). For the other firmwares it is infinite.
[[nodiscard]] double drawing_back_mm_s2(const planner::FirmwareConfig& firmware);

// Moves filament between neighbouring lines until |Δr| min(v, v') ≤ most_mm_s at every joint. The
// sum over all lines stays, and no line lays less than 0 if none did before.
void level_flow(const gcode::Position& start_mm, double most_mm_s, std::span<Stroke> strokes);

}  // namespace unflex::emit
