#pragma once

#include <cstddef>
#include <vector>

#include "unflex/planner/planner.hpp"

namespace unflex::run {

// Walks along a plan.
class PlanWalk {
 public:
  explicit PlanWalk(const std::vector<planner::PlannedMove>& moves) : moves_(&moves) {}

  [[nodiscard]] bool at_end() const { return index_ == moves_->size(); }
  [[nodiscard]] const planner::PlannedMove& move() const { return (*moves_)[index_]; }
  // Where the walk is.
  [[nodiscard]] gcode::Position position_mm() const { return move().position_mm(done_s_); }

  // Walks on to the time `t`. Calls visit(move, from, to) for each stretch on the way; from and to
  // are in seconds since the move's start.
  template <typename Visit>
  void to(double t, const Visit& visit) {
    for (; !at_end() && start_s_ + move().duration_s() <= t; ++index_, done_s_ = 0.0) {
      visit(move(), done_s_, move().duration_s());
      start_s_ += move().duration_s();
    }
    if (!at_end() && t > start_s_ + done_s_) {
      visit(move(), done_s_, t - start_s_);
      done_s_ = t - start_s_;
    }
  }

 private:
  const std::vector<planner::PlannedMove>* moves_;
  std::size_t index_ = 0;
  double start_s_ = 0.0;  // when the move starts
  double done_s_ = 0.0;   // how far into the move the walk is
};

}  // namespace unflex::run
