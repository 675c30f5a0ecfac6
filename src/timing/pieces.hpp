// The path of a run in pieces, each of which has limits of its own.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "unflex/planner/planner.hpp"
#include "unflex/timing/timing.hpp"

namespace unflex::timing {

struct Pieces {
  std::vector<planner::PlannedMove> moves;
  std::vector<MoveBounds> bounds;
  std::vector<std::size_t> counts;  // how many pieces each move of the path has
};

// The move from one share of its length to another; its timing is not that of the part.
[[nodiscard]] planner::PlannedMove part_of(const planner::PlannedMove& move, double from,
                                           double to);

// Cuts short pieces off both ends of a long move, as the timing differs near vertices alone.
// ends_s: the time that these pieces take at the speed of the slower neighbour.
[[nodiscard]] Pieces in_pieces(std::span<const planner::PlannedMove> path,
                               std::span<const MoveBounds> bounds, std::span<const double> ends_s);

// Joins neighbouring pieces of a move that are passed at one speed. counts: as in Pieces, for the
// moves.
void join_even(std::vector<planner::PlannedMove>& moves, std::vector<std::size_t>& counts);

}  // namespace unflex::timing
