// Marlin: a block's trapezoid in whole steps.
#pragma once

#include <cstdint>

#include "unflex/planner/marlin_planner.hpp"

namespace unflex::planner::marlin {

// Rates in steps/s, and how many step events each ramp takes.
struct Trapezoid {
  std::uint32_t initial_rate = 0;
  std::uint32_t final_rate = 0;
  std::uint32_t accel_steps = 0;
  std::uint32_t decel_steps = 0;
};

// The trapezoid between the entry speed and the exit speed, both in mm/s.
[[nodiscard]] Trapezoid make_trapezoid(const Block& block, float entry, float exit);

// Writes speeds and durations of the trapezoid into block.move.
void set_profile(const Trapezoid& trapezoid, Block& block);

}  // namespace unflex::planner::marlin
