// Filament of lines for a printer that smooths it.
//
// Klipper pushes S(E + K Ė): E is even within each line, K its pressure advance, and S the mean
// weighted by a triangle (chelper/kin_extruder.c). A hotend that needs just K lays S E of it. So E
// is what comes nearest to the wanted V once it is smoothed, whatever K is.
//
// Notation:
//   t_k, e_k   where lines join, and E there        κ_k   change of Ė there
//   h          half of the smooth time              v, d  speed and length of a line
//   J          the most that the flow may change where lines join, mm/s
//
// Away from a join S leaves E as it is. Near one
//
//   (S E)(τ) = E(τ) + Σ κ_k (h − |τ − t_k|)³/(6 h²)     over the joins with |τ − t_k| < h
//
// so e solves a linear problem with few diagonals:
//
//   min Σ c (S E − V)² + ρ Σ Δ(ΔE/d)² min(v, v')²
//   subject to |Δ(ΔE/d)| min(v, v') ≤ J     at the joins (filament_flow.hpp)
//
// The first sum is over Gauss's points of all lines, c being the way that they stand for; the
// second is over the joins, and decides only what S does not feel. A join that exceeds J is drawn
// to it by a weight, and the problem is solved again.
#pragma once

#include <functional>
#include <vector>

#include "lines_in_time.hpp"

namespace unflex::emit {

// e_0 … e_n, mm. A knot moves only where the lines on both of its sides lay, so e is V at either
// end and wherever laying begins or ends. No line that lays draws filament back. A join may still
// exceed J a little.
[[nodiscard]] std::vector<double> filament_to_smooth(
    const LinesInTime& lines, double smooth_s, double most_step_mm_s,
    const std::function<double(double)>& wanted_mm);

}  // namespace unflex::emit
