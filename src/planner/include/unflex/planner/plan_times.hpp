// The times of a plan's moves, and the move at a given time.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "unflex/planner/planner.hpp"

namespace unflex::planner {

// The start of each move, and the end of the last one. The first move starts at first_s.
[[nodiscard]] std::vector<double> starts_s(std::span<const PlannedMove> moves,
                                           double first_s = 0.0);

// The number of the last move that has started at time t; 0 before the first one has. starts_s: of
// at least one move, as starts_s() has it.
[[nodiscard]] std::size_t move_at(std::span<const double> starts_s, double t);

// The move at time t, for times that rise from call to call: `from` is the move at an earlier time.
[[nodiscard]] inline std::size_t move_at(std::span<const double> starts_s, double t,
                                         std::size_t from) {
  while (from + 2 < starts_s.size() && starts_s[from + 1] <= t) {
    ++from;
  }
  return from;
}

// Goes along a plan, stretch by stretch.
class PlanCursor {
 public:
  // The moves must stay where they are.
  explicit PlanCursor(std::span<const PlannedMove> moves)
      : moves_(moves), starts_s_(starts_s(moves)) {}

  [[nodiscard]] bool at_end() const { return index_ == moves_.size(); }
  [[nodiscard]] const PlannedMove& move() const { return moves_[index_]; }
  // Where the cursor is.
  [[nodiscard]] gcode::Position position_mm() const { return move().position_mm(done_s_); }

  // Goes on to time t. Calls visit(move, from, to) for each stretch on the way; from and to are in
  // seconds since the move's start.
  template <typename Visit>
  void to(double t, const Visit& visit) {
    for (; !at_end() && starts_s_[index_ + 1] <= t; ++index_, done_s_ = 0.0) {
      visit(move(), done_s_, move().duration_s());
    }
    if (!at_end() && t > starts_s_[index_] + done_s_) {
      visit(move(), done_s_, t - starts_s_[index_]);
      done_s_ = t - starts_s_[index_];
    }
  }
  void to(double t) {
    to(t, [](const PlannedMove&, double, double) {});
  }

 private:
  std::span<const PlannedMove> moves_;
  std::vector<double> starts_s_;
  std::size_t index_ = 0;
  double done_s_ = 0.0;  // how far into the move the cursor is
};

}  // namespace unflex::planner
