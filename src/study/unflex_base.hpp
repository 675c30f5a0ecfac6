// The base as unflex moves it.
#pragma once

#include <vector>

#include "unflex/study/bench.hpp"

namespace unflex::study {

// `parts` parabolas for each node interval. An error of kind internal if there is no solution.
[[nodiscard]] Result<BaseMotion> unflex_base(const compensate::Setup& setup,
                                             const std::vector<planner::PlannedMove>& plan,
                                             int parts, const compensate::Engine& engine);

// Lets the base accelerate by up to accel_mm_s2 on each axis.
void limit_accel(compensate::Setup& setup, double accel_mm_s2);

// The nozzle at rest there.
[[nodiscard]] dynamics::NozzleXY at_rest(const compensate::Setup& setup,
                                         const gcode::Position& place_mm);

}  // namespace unflex::study
