// The run's moves in time.
#pragma once

#include <cstddef>
#include <vector>

#include "unflex/emit/run.hpp"

namespace unflex::emit {

// The run's moves in time, and the height that belongs to a moment.
class Timetable {
 public:
  explicit Timetable(const Run& run);

  // Start of move i; i may be the number of moves.
  [[nodiscard]] double start_s(std::size_t i) const { return starts_s_[i]; }
  [[nodiscard]] std::size_t moves() const { return run_->moves->size(); }

  // The move at time t.
  [[nodiscard]] std::size_t move_at(double t) const;

  // Whether the moves have ended at time t.
  [[nodiscard]] bool tail_at(double t) const;

  // Whether the base moves in Z to make up for modes.
  [[nodiscard]] bool moves_in_z() const { return run_->base->above.has_value(); }
  // Z at time t: the plan's, and how far the base is above it.
  [[nodiscard]] double height_mm(double t) const;
  // The plan's Z at time t. Each move's change of Z is spread along the base's path while the move
  // lasts. This keeps the slope small where the base is slower than the plan.
  [[nodiscard]] double plan_height_mm(double t) const;

  // Whether a line across the boundary before move i would give either move too much filament or
  // too little, since filament per mm changes there.
  [[nodiscard]] bool filament_changes(std::size_t i) const;

  // The time at which each event stands: the end of the moves before it.
  [[nodiscard]] std::vector<double> event_times_s() const;
  [[nodiscard]] const std::vector<double>& starts_s() const { return starts_s_; }

 private:
  // Filament of move i per mm of the base's path.
  [[nodiscard]] double filament_per_mm(std::size_t i) const;
  [[nodiscard]] double travelled_mm(double t) const;

  const Run* run_;
  std::vector<double> starts_s_;      // when each move starts, and when the last one ends
  std::vector<double> travelled_mm_;  // length of the base's path at the nodes
};

}  // namespace unflex::emit
