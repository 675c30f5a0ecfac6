// RepRapFirmware: the speeds at the joints of provisional moves.
#pragma once

#include <deque>

#include "unflex/planner/rrf_planner.hpp"

namespace unflex::planner::rrf {

// Joins the last move, which stands still at both ends, to the one before it. Then raises the
// speeds at earlier joints as far as this allows. All trapezoids are set afterwards.
// frozen_extrudes: whether the last frozen move lays filament. The firmware asks whether the move
// before slows down. If that move is frozen, the firmware finds its extrusion rate in the same
// memory instead (DDA.h: beforePrepare and afterPrepare). This matters only where a lowered limit
// has made a move decelerate harder than it may.
void join_last(const Settings& settings, std::deque<Dda>& provisional, bool frozen_extrudes);

}  // namespace unflex::planner::rrf
