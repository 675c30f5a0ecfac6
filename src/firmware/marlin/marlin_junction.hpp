// Marlin: the speed at which one block may follow another.
#pragma once

#include "unflex/planner/marlin_planner.hpp"

namespace unflex::planner::marlin {

// How the queue enters a block.
struct BlockEntry {
  Vector distance_mm{};
  Vector speed_mm_s{};  // nominal, per axis
  float inverse_length = 0.0F;
  bool with_filament = false;
  bool moving = false;           // blocks that do not run yet are queued before this one
  float curve_radius_mm = 0.0F;  // of the arc that this block continues; 0 for none
};

// Highest squared speed at the start of the block, by junction deviation or classic jerk. Keeps in
// `previous` what these two need at the next junction.
[[nodiscard]] float max_entry_v2(const Settings& settings, const Block& block,
                                 const BlockEntry& entry, Previous& previous);

}  // namespace unflex::planner::marlin
