// Arcs as Klipper cuts them into straight pieces.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

namespace unflex::gcode {

// A helix in a plane (alpha, beta) and along the axis normal to it.
struct Arc {
  std::array<double, 3> start_mm{};  // alpha, beta, normal
  std::array<double, 3> end_mm{};
  std::array<double, 2> centre_offset_mm{};  // from the start: I J, I K or J K
  bool clockwise = false;
};

// The ends of the pieces, in order; the last is exactly arc.end_mm. nullopt if the arc would fall
// into more than a million pieces.
//
// Source: klippy/extras/gcode_arcs.py, ArcSupport.planArc (after Marlin's plan_arc).
//   φ  angle travelled, in (0, 2π] anticlockwise, [−2π, 0) clockwise; a full circle where start and
//      end coincide
//   n  = max(1, ⌊√((ρφ)² + Δz²) / resolution⌋) pieces, ρ the radius, Δz along the normal
[[nodiscard]] std::optional<std::vector<std::array<double, 3>>> plan_arc(const Arc& arc,
                                                                         double resolution_mm);

// The centre of an arc of a given radius, as an offset from its start: the short way round for a
// positive radius, the long way for a negative. A radius too small to reach the end becomes half
// the chord. nullopt where start and end coincide, as they leave the centre open.
//
// Source: Marlin, src/gcode/motion/G2_G3.cpp, GcodeSuite::G2_G3.
[[nodiscard]] std::optional<std::array<double, 2>> centre_from_radius(
    const std::array<double, 3>& start_mm, const std::array<double, 3>& end_mm, double radius_mm,
    bool clockwise);

}  // namespace unflex::gcode
