// How far the nozzle is from the sliced path if the base moves as optimised, before anything is
// written.
#pragma once

#include <cstddef>
#include <vector>

#include "unflex/dynamics/base_trajectory.hpp"
#include "unflex/dynamics/flexible_axis.hpp"
#include "unflex/planner/planner.hpp"
#include "unflex/verify/deviation.hpp"

namespace unflex::run {

// The error across the path while filament is laid, as a sum of squares over samples.
struct PathError {
  double sum_mm2 = 0.0;
  std::size_t samples = 0;

  void add(const PathError& other);
  [[nodiscard]] double rms_mm() const;
};

// The error in a run, sampled at the nodes of the base's motion. The base begins lead_in_s before
// the plan. start: the nozzle when the base begins.
[[nodiscard]] PathError path_error(const std::vector<planner::PlannedMove>& plan, double lead_in_s,
                                   const dynamics::BaseTrajectory& base,
                                   const dynamics::NozzleXY& start,
                                   const verify::NozzleModel& model);

}  // namespace unflex::run
