// A window whose nozzle shall stray little from the path, and may be early or late on it.
//
//   min Σ_k w_k Σ_c α_c { |p_c − q_c|² + ε |p_c − r|² + λ_k |p_c − r|² } + ρ Σ j²
//
//   c  pairs of a model of X and one of Y, with shares α_c
//   q  the place of the path nearest to p_c, among those that r passes within a reach of the time
//   λ  5 within a ms of sharp corners, which the nozzle would else cut, and 0 elsewhere
//
// q follows p_c. For a given q the cost is one of X plus one of Y, each a sum of squares of an
// AxisWindow:
//
//   w (1 + ε + λ) Σ_i α_i (p_i − a_i)²     a_i = (q̄_i + (ε + λ) r) / (1 + ε + λ)
//
// where q̄_i is the mean of q over the pairs that hold model i. So solving both axes and finding q
// anew alternate. In each round q goes farther than to the nearest place and keeps a share of its
// last way, as a heavy ball does (B. T. Polyak, "Some methods of speeding up the convergence of
// iteration methods", USSR Comput. Math. Math. Phys. 4 (1964) 1-17). Otherwise the remaining error
// along the path falls slowly.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "unflex/compensate/run.hpp"

namespace unflex::compensate {

// The vertices of a course's path, in half node periods from its first node on.
// origin_s: when the course's own moves begin.
[[nodiscard]] std::vector<PathVertex> path_of(const Course& course, double origin_s,
                                              double period_s);

// The part of the path that a window needs. The window begins at sample `first` and has `samples`
// samples. reach: in half node periods.
[[nodiscard]] std::vector<PathVertex> part_of(const std::vector<PathVertex>& path,
                                              std::size_t first, std::size_t samples, double reach);

// The optimum of each axis without limits. nullopt: rounding keeps it from being found.
using FreeSolutions = Axes<std::optional<AxisSolution>>;
// Finds q, and sets the aims and weights of the window. The window's limits do not count for q.
FreeSolutions aim(RunWindow& window);

}  // namespace unflex::compensate
