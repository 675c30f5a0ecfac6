#include "filament_ledger.hpp"

#include <algorithm>
#include <cmath>

namespace unflex::verify {
namespace {

// By how much the emitted run's clock may be off; a line this near to t_i counts as being there.
constexpr double kClockTolerance_s = 1e-4;

}  // namespace

void FilamentLedger::begin_run() {
  next_piece_ = path_->end();
  borders_.clear();
  q_mm_ = 0.0;
  f_mm_ = 0.0;
  last_distance_mm_ = 0.0;
}

void FilamentLedger::collect_borders() {
  for (; next_piece_ < path_->end(); ++next_piece_) {
    const PathPiece& piece = (*path_)[next_piece_];
    q_mm_ += piece.move.segment.delta(gcode::E);
    borders_.push_back({piece.end_s, q_mm_});
  }
}

void FilamentLedger::play(const planner::PlannedMove& move, double start_s) {
  collect_borders();
  const double end_s = start_s + move.duration_s();
  const double before_mm = f_mm_;
  f_mm_ += move.segment.delta(gcode::E);
  for (Border& border : borders_) {
    if (border.time_s - kClockTolerance_s >= end_s) {
      break;
    }
    if (!border.reached) {
      border.reached = true;
      border.lowest_f_mm = before_mm;
    }
  }
  while (!borders_.empty() && borders_.front().time_s + kClockTolerance_s <= end_s) {
    close(borders_.front(), borders_.front().lowest_f_mm, f_mm_);
    borders_.pop_front();
  }
}

void FilamentLedger::end_run() {
  collect_borders();
  for (; borders_.size() > 1; borders_.pop_front()) {
    const Border& border = borders_.front();
    close(border, border.reached ? border.lowest_f_mm : f_mm_, f_mm_);
  }
  // Whatever comes late still belongs to the last move.
  close({0.0, q_mm_}, f_mm_, f_mm_);
  borders_.clear();
}

void FilamentLedger::close(const Border& border, double lowest_f_mm, double highest_f_mm) {
  const double distance_mm =
      std::min(0.0, border.q_mm - lowest_f_mm) + std::max(0.0, border.q_mm - highest_f_mm);
  worst_mm_ = std::max(worst_mm_, std::abs(distance_mm - last_distance_mm_));
  last_distance_mm_ = distance_mm;
}

}  // namespace unflex::verify
