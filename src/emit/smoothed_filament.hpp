// Filament of lines for a printer that smooths it.
//
// Klipper pushes S(E + K Ė): E is even within each line, K its pressure advance, and S the mean
// weighted by a triangle (chelper/kin_extruder.c). A hotend that needs just K lays S E of it. So E
// is what comes nearest to the wanted V once it is smoothed, whatever K is.
//
// Notation:
//   t_k, e_k   where lines join, and E there        κ_k   change of Ė there
//   h          half of the smooth time              v     speed of a line
//
// Away from a join S leaves E as it is. Near one
//
//   (S E)(τ) = E(τ) + Σ κ_k (h − |τ − t_k|)³/(6 h²)     over the joins with |τ − t_k| < h
//
// so e solves a linear problem with few diagonals:
//
//   min Σ c (S E − V)²     over Gauss's points of all lines, c being the way that they stand for
#pragma once

#include <functional>
#include <vector>

namespace unflex::emit {

struct LaidLines {
  std::vector<double> times_s;      // t_0 … t_n, rising
  std::vector<double> speeds_mm_s;  // v of the n lines
};

// e_0 … e_n, mm. A knot moves only where the lines on both of its sides lay, so e is V at either
// end and wherever laying begins or ends. No line that lays draws filament back.
[[nodiscard]] std::vector<double> filament_to_smooth(
    const LaidLines& lines, double smooth_s, const std::function<double(double)>& wanted_mm);

}  // namespace unflex::emit
