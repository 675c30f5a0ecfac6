// Filament of lines for a printer that smooths it.
//
// Klipper pushes p = S(E + K Ė): E is even within each line, K its pressure advance, and S the mean
// weighted by a triangle (chelper/kin_extruder.c). A hotend that needs just K lays S E of it. So E
// is what comes nearest to the wanted V once it is smoothed, as far as the extruder can push p.
//
// Notation:
//   t_k, e_k   where lines join, and E there        κ_k   change of Ė there
//   h          half of the smooth time              v, d  speed and length of a line
//   J          the most that the flow may change where lines join, mm/s
//   A          the most that p may accelerate, mm/s²
//
// Away from a join S leaves E as it is. Near one
//
//   (S E)(τ) = E(τ) + Σ κ_k (h − |τ − t_k|)³/(6 h²)     over the joins with |τ − t_k| < h
//
// and the second derivative of a mean by a triangle is a difference:
//
//   p̈(τ) = (F(τ + h) − 2 F(τ) + F(τ − h))/h²,    F = E + K Ė
//
// so e solves a quadratic program with few diagonals:
//
//   min Σ c (S E − V)² + ρ Σ f²,    f = Δ(ΔE/d) min(v, v')
//   subject to  |f| ≤ J                      at the joins (filament_flow.hpp)
//               |mean of p̈ over 4 ms| ≤ A    every millisecond
//               ΔE ≥ a share of ΔV           in each line, so that none draws back
//
// The first sum is over Gauss's points of all lines, c being the way that they stand for; the
// second is over the joins, and decides only what S does not feel. A limit that cannot be kept is
// broken at a price (quadratic/elastic_program.hpp).
#pragma once

#include <functional>
#include <limits>
#include <vector>

#include "lines_in_time.hpp"

namespace unflex::emit {

// A printer's smoothing of E, and the limits of its extruder.
struct SmoothingExtruder {
  double advance_s = 0.0;                                             // K
  double smooth_s = 0.0;                                              // 2 h
  double most_step_mm_s = std::numeric_limits<double>::infinity();    // J
  double most_accel_mm_s2 = std::numeric_limits<double>::infinity();  // A
};

// e_0 … e_n, mm. A knot moves only where the lines on both of its sides lay, so e is V at either
// end and wherever laying begins or ends. No line that lays draws filament back. Where smoothing
// reaches over too many lines, they keep what is wanted.
[[nodiscard]] std::vector<double> filament_to_smooth(
    const LinesInTime& lines, const SmoothingExtruder& extruder,
    const std::function<double(double)>& wanted_mm);

}  // namespace unflex::emit
