// The method of the source thesis (Cisalpino, UFLA 2023): Hargraves–Paris collocation with the
// nozzle fixed to the plan, so that only the base is left to find.
//
//   p, ṗ   nozzle, given at the nodes by the plan      b, v   base and its velocity at the nodes
//   h      node period                                 f      ω²(b − p) + 2ζω(v − ṗ)
//
// The unknown is b, which starts at the plan's begin and at rest. Base and velocity follow each
// other node by node: a₂ = 2((b₂ − b₁)/h − v₁)/h and v₂ = v₁ + a₂h from v₁ = 0 and a₁ = 0 on.
// Equations, per interval with the ends 1 and 2 and the middle c, in mm and s:
//
//   position defect   −3(p₁ − p₂)/2h − (ṗ₁ + ṗ₂)/4 − ṗ_c = 0,      ṗ_c = (ṗ₁ + ṗ₂)/2 + h(f₁ − f₂)/8
//   velocity defect   −3(ṗ₁ − ṗ₂)/2h − (f₁ + f₂)/4 − f_c = 0,
//                     f_c = ω²((b₁ + b₂)/2 − p_c) + 2ζω((v₁ + v₂)/2 − ṗ_c),   p_c likewise
//   jerk              max(0, |a₂ − a₁|/h − a_max/h) = 0, weighted by kJerkWeight
//
// and once per axis
//
//   start             b = r, weighted by 10⁹; here it holds by construction
//
// In the reference case these are, for both axes, 2 · 49 unknowns against 2 · (48 + 48 + 48 + 1)
// equations. Source: the thesis' appendix B.
#pragma once

#include "unflex/dynamics/flexible_axis.hpp"
#include "unflex/rivals/axis_path.hpp"

namespace unflex::rivals {

inline constexpr double kJerkWeight = 1e-4;

// The least-squares point of all equations. An interior-point code stops there, because the
// equations have no solution. It is unique, because the sum of their squares is strictly convex.
// The effort of a step is linear in the length of the plan. max_accel_mm_s2 is a_max, above 0.
[[nodiscard]] SolvedPath thesis_least_squares(const AxisPath& reference,
                                              const dynamics::FlexibleAxis& axis, double period_s,
                                              double max_accel_mm_s2);

// The consistent half of the equations, which are the velocity defects alone. They determine v node
// by node, from v = 0 on.
[[nodiscard]] SolvedPath thesis_velocity_defects(const AxisPath& reference,
                                                 const dynamics::FlexibleAxis& axis,
                                                 double period_s);

}  // namespace unflex::rivals
