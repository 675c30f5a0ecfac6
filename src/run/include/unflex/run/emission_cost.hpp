// What it costs that the base's motion is written as few lines, on the printer's grid.
//
//   p*(t)  nozzle if the base moved as optimised       p(t)  nozzle as the printer replays the
//   lines
#pragma once

#include <vector>

#include "unflex/dynamics/base_trajectory.hpp"
#include "unflex/dynamics/flexible_axis.hpp"
#include "unflex/planner/planner.hpp"
#include "unflex/verify/deviation.hpp"

namespace unflex::run {

class EmissionCost {
 public:
  // Adds a run. original: its sliced moves, which begin lead_in_s after the base; replayed: the
  // printer's plan of the written lines, which begins late_s before the base; start: the nozzle
  // when the base begins.
  void add(const std::vector<planner::PlannedMove>& original, double lead_in_s,
           const dynamics::BaseTrajectory& base, const std::vector<planner::PlannedMove>& replayed,
           double late_s, const dynamics::NozzleXY& start, const verify::NozzleModel& model);

  // The part of p − p* across the path, where filament is laid.
  [[nodiscard]] double rms_mm() const;
  [[nodiscard]] double max_mm() const { return max_mm_; }

 private:
  double sum_mm2_ = 0.0;
  double max_mm_ = 0.0;
  std::size_t samples_ = 0;
};

}  // namespace unflex::run
