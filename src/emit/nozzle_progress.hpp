// The nozzle's progress along the sliced path. The filament of a run follows it.
//
// Notation:
//   r, p, b   reference, nozzle and base         s(t)   length of path that r has covered
//   s_n(t)    where along the path p is: the u that minimises |p − path(u)|² + λ (u − s)²
//   Q(u)      filament that the sliced file lays up to there
#pragma once

#include <cstddef>
#include <vector>

#include "unflex/dynamics/flexible_axis.hpp"
#include "unflex/dynamics/frequency_field.hpp"
#include "unflex/emit/run.hpp"

namespace unflex::emit {

class NozzleProgress {
 public:
  // The nozzle hangs on the run's base. starts_s: when each move starts, and when the last one
  // ends.
  NozzleProgress(const Run& run, const std::vector<double>& starts_s,
                 const Axes<dynamics::FlexibleAxis>& nozzle, const dynamics::FieldXY& field);

  // Q(s_n(t)), mm, from 0 on. As the nozzle never goes back, it is monotone where Q is.
  [[nodiscard]] double filament_mm(double t) const;
  // The two parts of filament_mm(): filament that moves lay, and filament that wipes draw back,
  // which is below 0.
  [[nodiscard]] double laid_mm(double t) const;
  [[nodiscard]] double drawn_back_mm(double t) const;
  [[nodiscard]] double all_laid_mm() const { return laid_mm_.back(); }
  // s_n(t)
  [[nodiscard]] double way_mm(double t) const { return progress_mm(t); }
  // Filament per s that the plan lays where the run begins, and where the next part takes over; 0
  // at rest.
  [[nodiscard]] double flow_begin_mm_s() const { return flow_begin_mm_s_; }
  [[nodiscard]] double flow_end_mm_s() const { return flow_end_mm_s_; }
  // When the nozzle reaches the beginning of move i.
  [[nodiscard]] double begin_s(std::size_t i) const;
  // Whether the nozzle has left the run's first move behind.
  [[nodiscard]] bool past_first_move(double t) const;

 private:
  // s_n of a nozzle at p, while the reference is on `move` and s = reference_mm.
  [[nodiscard]] double nearest_mm(const XY& p_mm, std::size_t move, double reference_mm) const;
  [[nodiscard]] double progress_mm(double t) const;
  // The value at time t of a quantity that is known where moves begin and end.
  [[nodiscard]] double along(const std::vector<double>& at_moves, double t) const;

  const std::vector<planner::PlannedMove>* moves_;
  double period_s_;
  std::vector<double> path_mm_;      // where each move begins along the path, and the end
  std::vector<double> filament_mm_;  // Q there
  std::vector<double> laid_mm_;      // what of it is laid
  double flow_begin_mm_s_ = 0.0;
  double flow_end_mm_s_ = 0.0;
  std::vector<double> progress_mm_;  // s_n at the base's nodes
};

}  // namespace unflex::emit
