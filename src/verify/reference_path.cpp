#include "unflex/verify/reference_path.hpp"

#include <cmath>
#include <utility>

namespace unflex::verify {
namespace {

// Old pieces are dropped in batches, so that the pieces can lie in one block of memory.
constexpr std::size_t kDropBatch = 1024;

}  // namespace

planner::PlannedMove resting(double x_mm, double y_mm, double duration_s) {
  planner::PlannedMove move;
  move.segment.start_mm = {x_mm, y_mm, 0.0, 0.0};
  move.segment.end_mm = move.segment.start_mm;
  move.cruise_s = duration_s;
  return move;
}

double PathPiece::covered_xy_mm(double t) const {
  return move.length_mm > 0.0 ? move.distance_mm(t - start_s) / move.length_mm * length_xy_mm : 0.0;
}

void ReferencePath::begin_section(double lead_in_s) {
  ++section_;
  section_start_s_ = end_s_;
  end_s_ += lead_in_s;
  section_complete_ = false;
}

void ReferencePath::extend_to(double t) {
  while (!section_complete_ && end_s_ <= t) {
    planner::PlannedMove move;
    if (source_(move)) {
      const bool measured = move.segment.length_xy_mm() > 0.0;
      append(std::move(move), measured);
    } else {
      section_complete_ = true;
    }
  }
}

void ReferencePath::hold(double x_mm, double y_mm, double duration_s) {
  append(resting(x_mm, y_mm, duration_s), true);
}

void ReferencePath::append(planner::PlannedMove move, bool measured) {
  PathPiece piece;
  piece.measured = measured;
  piece.section = section_;
  piece.start_s = end_s_;
  piece.end_s = end_s_ + move.duration_s();
  piece.x_mm = move.segment.start_mm[gcode::X];
  piece.y_mm = move.segment.start_mm[gcode::Y];
  piece.length_xy_mm = move.segment.length_xy_mm();
  if (piece.length_xy_mm > 0.0) {
    piece.direction_x = move.segment.delta(gcode::X) / piece.length_xy_mm;
    piece.direction_y = move.segment.delta(gcode::Y) / piece.length_xy_mm;
  }
  piece.extruding = move.segment.extruding();
  piece.filament_mm = filament_mm_;
  if (piece.extruding) {
    filament_mm_ += move.segment.delta(gcode::E);
  }
  piece.move = std::move(move);
  end_s_ = piece.end_s;
  pieces_.push_back(std::move(piece));
}

void ReferencePath::discard_before(double t) {
  while (pieces_.size() > kDropBatch && pieces_[kDropBatch - 1].end_s < t) {
    pieces_.erase(pieces_.begin(), pieces_.begin() + kDropBatch);
    dropped_ += kDropBatch;
  }
}

}  // namespace unflex::verify
