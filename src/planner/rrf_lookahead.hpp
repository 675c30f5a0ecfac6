// RepRapFirmware: the speeds at the joints of provisional moves.
#pragma once

#include <deque>

#include "unflex/planner/rrf_planner.hpp"

namespace unflex::planner::rrf {

// Joins the last move, which stands still at both ends, to the one before it, and raises the speeds
// at earlier joints as far as that now allows. All trapezoids are set afterwards.
void join_last(const Settings& settings, std::deque<Dda>& provisional);

}  // namespace unflex::planner::rrf
