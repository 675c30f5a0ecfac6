// A window whose nozzle shall stray little from the path, and may be early or late on it.
//
//   min Σ_k w_k Σ_c α_c { |p_c − q_c|² + ε |p_c − r|² + λ_k |p_c − r|² } + ρ Σ j²
//
//   c  pairs of a model of X and one of Y, with shares α_c
//   q  the place of the path nearest to p_c, among those that r passes within a reach of the time
//   λ  3 within a ms of sharp corners, which the nozzle would else cut, and 0 elsewhere
//
// q follows p_c. For a given q the cost is one of X plus one of Y, each a sum of squares of an
// AxisWindow:
//
//   w (1 + ε + λ) Σ_i α_i (p_i − a_i)²     a_i = (q̄_i + (ε + λ) r) / (1 + ε + λ)
//
// where q̄_i is the mean of q over the pairs that hold model i. So both axes are solved in turns
// with finding q anew. Each turn q goes 1.7 times as far as it should, since what is left of the
// error along the path falls slowly otherwise.
#pragma once

#include "unflex/compensate/run.hpp"

namespace unflex::compensate {

// Finds q, and sets aims and weights of the window. Its limits do not count for q.
void aim(RunWindow& window);

}  // namespace unflex::compensate
