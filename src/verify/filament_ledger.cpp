#include "filament_ledger.hpp"

#include <algorithm>
#include <cmath>

namespace unflex::verify {
namespace {

// δ: by how much the emitted run's clock may be off.
constexpr double kClockTolerance_s = 2e-4;

}  // namespace

void FilamentLedger::begin_run(const ReferencePath& path) {
  path_ = &path;
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
  const auto laid_until = [&](double t) {
    return before_mm + (f_mm_ - before_mm) * (t - start_s) / (end_s - start_s);
  };
  for (Border& border : borders_) {
    const double from_s = border.time_s - kClockTolerance_s;
    if (from_s >= end_s) {
      break;
    }
    if (!border.reached) {
      const bool line_ends_here = end_s < border.time_s + kClockTolerance_s;
      border.reached = true;
      border.from_f_mm = line_ends_here && from_s > start_s ? laid_until(from_s) : before_mm;
    }
  }
  // The last known border may be the end of the run. end_run() closes that one.
  for (; borders_.size() > 1 && borders_.front().time_s + kClockTolerance_s <= end_s;
       borders_.pop_front()) {
    const Border& border = borders_.front();
    const bool line_begins_here = start_s > border.time_s - kClockTolerance_s;
    close(border.q_mm, border.from_f_mm,
          line_begins_here ? laid_until(border.time_s + kClockTolerance_s) : f_mm_);
  }
}

void FilamentLedger::end_run() {
  collect_borders();
  for (; borders_.size() > 1; borders_.pop_front()) {
    const Border& border = borders_.front();
    close(border.q_mm, border.reached ? border.from_f_mm : f_mm_, f_mm_);
  }
  // Filament that comes late still belongs to the last move.
  close(q_mm_, f_mm_, f_mm_);
  borders_.clear();
}

// If filament is pulled back, from_f_mm is the larger bound.
void FilamentLedger::close(double q_mm, double from_f_mm, double to_f_mm) {
  const double distance_mm =
      q_mm - std::clamp(q_mm, std::min(from_f_mm, to_f_mm), std::max(from_f_mm, to_f_mm));
  worst_mm_ = std::max(worst_mm_, std::abs(distance_mm - last_distance_mm_));
  last_distance_mm_ = distance_mm;
}

}  // namespace unflex::verify
