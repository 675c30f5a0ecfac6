#include "unflex/verify/reference_path.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace unflex::verify {
namespace {

// Old pieces are dropped in batches, so that the pieces can lie in one block of memory.
constexpr std::size_t kDropBatch = 1024;

}  // namespace

planner::PlannedMove resting(const XY& place_mm, double duration_s) {
  planner::PlannedMove move;
  move.segment.start_mm = {place_mm.x, place_mm.y, 0.0, 0.0};
  move.segment.end_mm = move.segment.start_mm;
  move.cruise_s = duration_s;
  return move;
}

std::size_t PathPiece::passage_after(double t) const {
  const auto after = std::upper_bound(
      timing.begin() + 1, timing.end() - 1, t - start_s,
      [](double time_s, const Passage& passage) { return time_s < passage.time_s; });
  return static_cast<std::size_t>(after - timing.begin());
}

double PathPiece::covered_xy_mm(double t) const {
  if (!timing.empty() && move.length_mm > 0.0) {
    const std::size_t after = passage_after(t);
    const Passage& from = timing[after - 1];
    const Passage& to = timing[after];
    const double share =
        to.time_s > from.time_s
            ? std::clamp((t - start_s - from.time_s) / (to.time_s - from.time_s), 0.0, 1.0)
            : 1.0;
    return (from.covered_mm + share * (to.covered_mm - from.covered_mm)) / move.length_mm *
           length_xy_mm;
  }
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
    ReferenceMove reference;
    if (source_(reference)) {
      const bool measured = reference.move.segment.length_xy_mm() > 0.0;
      append(std::move(reference), measured);
    } else {
      section_complete_ = true;
    }
  }
}

void ReferencePath::hold(const XY& place_mm, double duration_s) {
  append({resting(place_mm, duration_s), {}}, true);
}

void ReferencePath::append(ReferenceMove reference, bool measured) {
  const double duration_s = reference.duration_s();
  planner::PlannedMove& move = reference.move;
  PathPiece piece;
  piece.measured = measured;
  piece.section = section_;
  piece.start_s = end_s_;
  piece.end_s = end_s_ + duration_s;
  piece.start_mm = xy_of(move.segment.start_mm);
  piece.length_xy_mm = move.segment.length_xy_mm();
  if (piece.length_xy_mm > 0.0) {
    piece.direction = (xy_of(move.segment.end_mm) - piece.start_mm) / piece.length_xy_mm;
  }
  piece.extruding = move.segment.extruding();
  piece.filament_mm = filament_mm_;
  if (piece.extruding) {
    filament_mm_ += move.segment.delta(gcode::E);
  }
  piece.move = std::move(move);
  piece.timing = std::move(reference.timing);
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
