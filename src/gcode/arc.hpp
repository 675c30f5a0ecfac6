// Arcs as the firmwares cut them into straight pieces.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "unflex/gcode/interpreter.hpp"

namespace unflex::gcode {

// A helix in a plane (alpha, beta) and along the axis normal to it.
struct Arc {
  std::array<double, 3> start_mm{};  // alpha, beta, normal
  std::array<double, 3> end_mm{};
  std::array<double, 2> centre_offset_mm{};  // from the start: I J, I K or J K
  bool clockwise = false;
};

// The end of a piece.
struct ArcPiece {
  std::array<double, 2> end_mm{};  // alpha, beta
  // Share so far of the travel along the normal and of the filament.
  double share = 1.0;
};

// Limits memory: one line must not fall into millions of pieces.
inline constexpr double kMostArcPieces = 1e5;

// The pieces in order; the last ends exactly at the arc's end. nullopt if there would be more than
// kMostArcPieces, or more than the firmware can count.
using ArcPieces = std::optional<std::vector<ArcPiece>>;

// Source: Klipper, klippy/extras/gcode_arcs.py, ArcSupport.planArc (after Marlin's plan_arc).
//   φ  angle travelled, in (0, 2π] anticlockwise, [−2π, 0) clockwise; a full circle where start and
//      end coincide
//   n  = max(1, ⌊√((ρφ)² + Δz²) / resolution⌋) pieces, ρ the radius, Δz along the normal
[[nodiscard]] ArcPieces plan_arc(const Arc& arc, double resolution_mm);

// Source: Marlin 2.1.2, src/gcode/motion/G2_G3.cpp, plan_arc.
//   ℓ  = ρ|φ|, length without the normal;  s = MAX_ARC_SEGMENT_MM, or v / ARC_SEGMENTS_PER_SEC
//        clamped to [MIN_ARC_SEGMENT_MM, MAX_ARC_SEGMENT_MM]
//   n₀ = max(⌊ℓ/s⌋, ⌈MIN_CIRCLE_SEGMENTS · |φ|/2π⌉)
//   n  = ⌈ℓ/max⌉ if ℓ/n₀ > max, max(1, ⌊ℓ/min⌋) if ℓ/n₀ < min, else n₀
// The radius vector is turned by sin θ ≈ θ − θ³/6, cos θ ≈ 1 − θ²/2, and computed afresh at every
// N_ARC_CORRECTION-th piece. `circles` full turns come first, each an arc of its own.
// Empty if the angle is zero, since Marlin leaves such an arc out.
[[nodiscard]] ArcPieces plan_marlin_arc(const Arc& arc, int circles, double feed_mm_s,
                                        const MarlinArcs& rules);

// Source: RepRapFirmware 3.5, src/GCodes/GCodes.cpp, DoArcMove and ReadMove; Configuration.h.
//   s  = √(8ρ · 0.005 mm) or v / (200/s), the smaller, but 0.02 mm at least and 1 mm at most
//   n  = max(1, ⌊ρ|φ|/s + 0.8⌋)
[[nodiscard]] ArcPieces plan_rrf_arc(const Arc& arc, double feed_mm_s);

// The centre of an arc of a given radius, as an offset from its start: the short way round for a
// positive radius, the long way for a negative. A radius too small to reach the end becomes half
// the chord. nullopt where start and end coincide, since any centre would then do.
//
// Source: Marlin, src/gcode/motion/G2_G3.cpp, GcodeSuite::G2_G3; RepRapFirmware's DoArcMove gives
// the same, and refuses a radius that is too small by more than 1 %.
[[nodiscard]] std::optional<std::array<double, 2>> centre_from_radius(
    const std::array<double, 3>& start_mm, const std::array<double, 3>& end_mm, double radius_mm,
    bool clockwise);

}  // namespace unflex::gcode
