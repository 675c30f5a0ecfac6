// Direct collocation by Hargraves & Paris, "Direct trajectory optimization using nonlinear
// programming and collocation", J. Guidance 10 (1987) 338–342.
//
// On each interval of length h between nodes 1 and 2 the states are the cubic that meets x₁, x₂ and
// the slopes f₁, f₂ there, the controls are linear, and the dynamics hold at the middle (their
// eq. 6 to 8; in Cisalpino's eq. 2.4 the signs of the second are misprinted):
//
//   x_c = (x₁ + x₂)/2 + h (f₁ − f₂)/8
//   ẋ_c = −3 (x₁ − x₂)/(2h) − (f₁ + f₂)/4
//   Δ   = ẋ_c − f(x_c, u_c) = 0,   u_c = (u₁ + u₂)/2
//
// The cost is integrated by Simpson's rule over the same three points, h (L₁ + 4 L_c + L₂)/6, and
// the slope cost is h · R ((u₂ − u₁)/h)².
//
// Unknowns, in order: node 0: x₀, u₀; node 1: x₁, u₁; … Constraints, in order: interval 0: Δ (one
// per state), then (u₂ − u₁)/h for each control whose slope is limited; interval 1: …
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "unflex/collocation/optimal_control_problem.hpp"
#include "unflex/nlp/problem.hpp"

namespace unflex::collocation {

// The nonlinear program of the problem on the mesh. times: the nodes, increasing, at least two. The
// problem must outlive the program. Derivatives are exact.
[[nodiscard]] std::unique_ptr<nlp::Problem> transcribe(const OptimalControlProblem& problem,
                                                       std::vector<double> times);

// z at node k of a solution of the transcribed program.
[[nodiscard]] PointVector node(const OptimalControlProblem& problem, std::span<const double> x,
                               int k);

}  // namespace unflex::collocation
