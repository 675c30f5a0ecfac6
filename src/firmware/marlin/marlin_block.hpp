// Marlin: from steps to a block with its limits.
#pragma once

#include <cstddef>

#include "unflex/planner/marlin_planner.hpp"

namespace unflex::planner::marlin {

[[nodiscard]] Settings make_settings(const Limits& limits, const FirmwareConfig& config);

// Squared speed reached from v2 over the length (max_allowable_speed_sqr).
[[nodiscard]] inline float reachable_v2(const Block& block, float v2) {
  return v2 + 2.0F * block.accel_mm_s2 * block.length_mm;
}

// The part of a block that the file decides.
struct Request {
  Steps delta{};
  float feed_mm_s = 0.0F;
  float curve_radius_mm = 0.0F;
  float e_factor = 1.0F;  // steps of E per step of its reading
};

// Fills in all of the block but its move. False, and `previous` untouched, if the block is too
// short to be queued. `moves_queued`: blocks in the buffer that do not run yet.
[[nodiscard]] bool populate_block(const Settings& settings, const Request& request,
                                  std::size_t moves_queued, Previous& previous, Block& block);

}  // namespace unflex::planner::marlin
