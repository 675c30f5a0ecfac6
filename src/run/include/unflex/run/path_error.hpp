// The nozzle's distance from where it should be, across the sliced path, while filament is laid.
//
//   path_error()           p* from the path; p* is the nozzle on the base as optimised
//   add_emission_error()   p from p*; p is the nozzle on the lines as the printer replays them
//
// The second error is the cost of writing the base's motion as few lines, on the printer's grid.
#pragma once

#include <cstddef>
#include <vector>

#include "unflex/dynamics/base_trajectory.hpp"
#include "unflex/dynamics/flexible_axis.hpp"
#include "unflex/dynamics/frequency_field.hpp"
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

// A run and the base that was found for it, which must outlive this.
struct RunOnBase {
  const std::vector<planner::PlannedMove>& plan;  // the sliced moves
  double lead_in_s;                               // how long before them the base begins
  const dynamics::BaseTrajectory& base;
  const dynamics::NozzleXY& start;  // the nozzle when the base begins
};

// Both are sampled at the nodes of the base's motion.
[[nodiscard]] PathError path_error(const RunOnBase& run, const verify::NozzleModel& model,
                                   const dynamics::FieldXY& field);
// Adds a run. replayed: the printer's plan of the written lines, which begins late_s before the
// base. Frequencies are the same everywhere, since the motions are nearly equal.
void add_emission_error(const RunOnBase& run, const std::vector<planner::PlannedMove>& replayed,
                        double late_s, const verify::NozzleModel& model, PathError& error);

}  // namespace unflex::run
