// How far the nozzle is from where it should be across the sliced path, while filament is laid:
//
//   path_error()      of the nozzle p* that hangs on the base as optimised, from the path
//   emission_error()  of the nozzle p that the printer's replay of the lines makes, from p*: what
//   it
//                     costs that the base's motion is written as few lines, on the printer's grid
#pragma once

#include <cstddef>
#include <vector>

#include "unflex/dynamics/base_trajectory.hpp"
#include "unflex/dynamics/flexible_axis.hpp"
#include "unflex/planner/planner.hpp"
#include "unflex/verify/deviation.hpp"

namespace unflex::run {

// A sum over samples.
struct PathError {
  double sum_mm2 = 0.0;
  double max_mm = 0.0;
  std::size_t samples = 0;

  void add(double away_mm);
  void add(const PathError& other);
  [[nodiscard]] double rms_mm() const;
};

// A run's sliced moves, the base that was found for them, which begins lead_in_s before them, and
// the nozzle when the base begins. All of it must stay where it is.
struct RunOnBase {
  const std::vector<planner::PlannedMove>& plan;
  double lead_in_s;
  const dynamics::BaseTrajectory& base;
  const dynamics::NozzleXY& start;
};

// Both are sampled at the nodes of the base's motion.
[[nodiscard]] PathError path_error(const RunOnBase& run, const verify::NozzleModel& model);
// Adds a run. replayed: the printer's plan of the written lines, which begins late_s before the
// base.
void add_emission_error(const RunOnBase& run, const std::vector<planner::PlannedMove>& replayed,
                        double late_s, const verify::NozzleModel& model, PathError& error);

}  // namespace unflex::run
