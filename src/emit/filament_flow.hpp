// The flow of filament from line to line, where the firmware slows down for a jump of it.
//
// Notation:
//   q, d, T   of a line: filament, length, time      r = q/d, v = d/T
//   Δr        change of r where two lines join
#pragma once

#include <span>

#include "strokes.hpp"

namespace unflex::emit {

// By how much the flow, mm of filament per s, may jump where lines join without the firmware
// slowing down there: Klipper passes a joint at no more than instantaneous_corner_velocity / |Δr|
// (kinematics/extruder.py, calc_junction). The others' limits of E are raised in a run; infinity.
[[nodiscard]] double most_flow_step_mm_s(const planner::FirmwareConfig& firmware);

// Moves filament between neighbouring lines until |Δr| min(v, v') ≤ most_mm_s at every joint. What
// all of them lay stays what it was, and no line lays less than 0 if none did.
void level_flow(const gcode::Position& start_mm, double most_mm_s, std::span<Stroke> strokes);

}  // namespace unflex::emit
