// How fast each line of a run is to be.
#pragma once

#include <vector>

#include "strokes.hpp"

namespace unflex::emit {

// Sets the speeds of the strokes, and the digits of F they need, so that the firmware takes the
// time each of them was given. mm_s_per_feed: what F1 means.
void set_speeds(const gcode::Position& start_mm, const EmitOptions& options, double mm_s_per_feed,
                std::vector<Stroke>& strokes);

}  // namespace unflex::emit
