// Filament that the extruder pushes with each line of a run, so that the hotend delivers the
// filament that the nozzle needs. This is an optimal-control problem with a first-order plant.
//
// Notation, for line k of n:
//   T, d     its duration, s, and length, mm
//   w        filament wanted while it lasts, mm
//   x        filament pushed meanwhile, evenly, mm
//   u_k      filament pressed together at its end, mm; u_0 is given, and so is what u_n shall be, U
//   K        P'(q) at the flow that is wanted, s (dynamics::HotendPressure)
//   a        e^(−T/K)
//   ε        filament that comes out meanwhile, minus w, mm
//   η        the same if the flow were what it is at the end of the line, mm
//   c        weight of ε²
//   m, M     the least and the most that it may push, mm
//   f_j      change of the flow pushed where lines j and j + 1 join, mm/s, and J_j what it may be
//
// In a line the flow q goes to x/T as e^(−t/K). So
//
//   u_k − P_k = a (u_{k−1} − P_k) + K (1 − a) (x_k/T − q_k)
//   ε_k = x_k − (u_k − u_{k−1}) − w_k
//
// where P and K are taken at the wanted flow q. Klipper passes a join at no more than
// J/|Δ(x/d)| (kinematics/extruder.py, calc_junction), so f is Δ(x/d) times the slower of both
// speeds. The problem in u_1 … u_n is
//
//   min ½ Σ c (ε² + κ η²) + ½ c_n (u_n − U)² + ½ ρ Σ f²
//   subject to   |f_j| ≤ J_j,  m_k ≤ x_k ≤ M_k,  Σ x = Σ w + U − u_0
//
// η damps what ε does not see: a flow that is too high at the beginning of a line and too low at
// its end, and the other way round in the next one.
//
// A solution exists if pushing an equal amount per mm in all lines keeps to m and M. x depends on
// two unknowns, f on three. So the Hessian has two diagonals on either side of its own, and a
// solution takes a time that grows as n.
#pragma once

#include <cstddef>
#include <vector>

namespace unflex::emit {

struct PressureLine {
  double duration_s = 0.0;      // T
  double length_mm = 0.0;       // d
  double wanted_mm = 0.0;       // w
  double slope_s = 0.0;         // K
  double rest_mm = 0.0;         // P(q) − K q: 0 for linear pressure
  double weight = 1.0;          // c, 1/mm
  double most_step_mm_s = 0.0;  // J at the join with the next line
  double least_mm = 0.0;        // m
  double most_mm = 0.0;         // M

  [[nodiscard]] double speed_mm_s() const { return length_mm / duration_s; }
};

// κ
inline constexpr double kAtEnds = 0.3;
// ρ, s²/mm. It decides only what the errors leave open.
inline constexpr double kSmoothness = 1e-7;

// The pressures at the beginning and at the end of a run.
struct PressureEnds {
  double begin_mm = 0.0;
  double end_mm = 0.0;
};

// Filament pushed with each line, x. A single line, and lines for which no solution is found, push
// the wanted filament.
[[nodiscard]] std::vector<double> pushed_filament(const std::vector<PressureLine>& lines,
                                                  const PressureEnds& ends);

}  // namespace unflex::emit
