// Filtered B-splines: the base is a B-spline whose coefficients are chosen so that the same
// combination of *filtered* basis functions, each sent through the model of the axis, comes closest
// to the reference in the least-squares sense.
//
//   C. E. Okwudire, K. S. Ramani & M. Duan, "A trajectory optimization method for improved tracking
//   of motion commands using CNC machines that experience unwanted vibration", CIRP Annals 65
//   (2016) 373–376; with limited preview M. Duan, D. Yoon & C. E. Okwudire, "A limited-preview
//   filtered B-spline approach to tracking control – with application to vibration-induced error
//   compensation of a 3D printer", Mechatronics 56 (2018) 287–296.
//
//   b(t) = Σ c_j N(t/Δ − j),   p(t) = Σ c_j φ(t − jΔ),   min Σ_i (r(t_i) − p(t_i))²
//
//   N   cardinal B-spline of degree 5 on [0, 6]     φ   what the nozzle does while the base makes N
//
// Here: coefficients at rest before the lead-in and after the tail, samples Δ/5 apart, windows of
// 60 coefficients of which the first 30 are kept. The method knows no limits of the base.
#pragma once

#include "unflex/dynamics/flexible_axis.hpp"
#include "unflex/rivals/axis_path.hpp"

namespace unflex::rivals {

struct SplineOptions {
  double knot_s = 0.005;   // Δ
  double lead_in_s = 0.0;  // the base may begin to move this long before the reference
  double tail_s = 0.0;     // the base may still move for this long after the reference
};

// The unknowns of the problem are the free coefficients. Its equations are the samples.
[[nodiscard]] SolvedPath filtered_spline(const AxisPath& reference,
                                         const dynamics::FlexibleAxis& axis,
                                         const SplineOptions& options);

}  // namespace unflex::rivals
