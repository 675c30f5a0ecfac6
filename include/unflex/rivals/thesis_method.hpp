// The method of the source thesis (Cisalpino, UFLA 2023): Hargraves–Paris collocation with the
// nozzle fixed to the plan, so that only the base is left to find.
//
//   p, ṗ   nozzle, given at the nodes by the plan      b, v   base and its velocity at the nodes
//   h      node period                                 f      ω²(b − p) + 2ζω(v − ṗ)
//
// The unknown is v; b follows from it by the trapezoidal rule, b₂ = b₁ + h (v₁ + v₂)/2. Equations,
// per interval with the ends 1 and 2 and the middle c, in mm and s:
//
//   position defect   −3(p₁ − p₂)/2h − (ṗ₁ + ṗ₂)/4 − ṗ_c = 0,      ṗ_c = (ṗ₁ + ṗ₂)/2 + h(f₁ − f₂)/8
//   velocity defect   −3(ṗ₁ − ṗ₂)/2h − (f₁ + f₂)/4 − f_c = 0,
//                     f_c = ω²((b₁ + b₂)/2 − p_c) + 2ζω((v₁ + v₂)/2 − ṗ_c),   p_c likewise
//   jerk              (v₁ − 2v₂ + v₃)/h² = 0, weighted by kJerkWeight
//   start             b = r, which holds by construction, and v = 0, weighted by kStartWeight
//
// In the reference case that is, for both axes, 2 · 49 unknowns against 2 · (48 + 48 + 47 + 2)
// equations. docs/theory.md tells how the weights were found.
#pragma once

#include "unflex/dynamics/flexible_axis.hpp"
#include "unflex/rivals/axis_path.hpp"

namespace unflex::rivals {

inline constexpr double kJerkWeight = 1e-4;
inline constexpr double kStartWeight = 1e3;

// The least-squares point of all equations. An interior-point code stops there, because the
// equations have no solution. The effort is linear in the length of the plan.
[[nodiscard]] AxisPath thesis_least_squares(const AxisPath& reference,
                                            const dynamics::FlexibleAxis& axis, double period_s);

// The consistent half of the equations, which are the velocity defects alone. They determine v node
// by node, from v = 0 on.
[[nodiscard]] AxisPath thesis_velocity_defects(const AxisPath& reference,
                                               const dynamics::FlexibleAxis& axis, double period_s);

}  // namespace unflex::rivals
