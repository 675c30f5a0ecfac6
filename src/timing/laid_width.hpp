// How evenly an extruder whose acceleration is limited can lay what the nozzle asks for.
//
//   V   filament that the slicer asks for up to where the nozzle is, mm      q = V̇
//   y   filament that is laid, mm            x = y − V      w   way of the nozzle, mm
//   p   filament that the extruder pushes, mm:    ṗ = ẏ + P'(q) ÿ
//   P   filament that the hotend presses together at a flow, mm
//
//   min Σ x² Δw    s.t.  |mean of p̈ over 4 ms| ≤ A
//
// This is the problem that emit/smoothed_filament.cpp solves for lines of G-code. Here y has a knot
// every 2 ms, and a corner velocity of the extruder and Klipper's smoothing are left out, so the
// result is a little too good.
#pragma once

#include <span>
#include <vector>

#include "unflex/timing/timing.hpp"

namespace unflex::timing {

// The error of the filament laid around each moment, as a share of the filament asked for there. It
// is taken over 0.4 mm, as in verification, and not within 1 mm of where laying begins or ends. The
// moments are `period_s` apart. laid_mm: V there; way_mm: how far the nozzle has come along the
// path.
[[nodiscard]] std::vector<double> width_errors(std::span<const double> laid_mm,
                                               std::span<const double> way_mm, double period_s,
                                               const Extruder& extruder);

}  // namespace unflex::timing
