#include "reference_phase.hpp"

#include <cstddef>

namespace unflex::verify {
namespace {

struct AlongMove {
  double covered_mm = 0.0;   // in X and Y
  double speed_mm_s = 0.0;   // in X and Y
  double accel_mm_s2 = 0.0;  // along the whole move
};

// For a move that is timed as planned. Times are since it began; middle_s is inside the phase.
AlongMove as_planned(const planner::PlannedMove& move, double now_s, double middle_s,
                     double share_xy) {
  double accel_mm_s2 = 0.0;
  double phase_end_s = 0.0;
  for (const planner::Phase& phase : move.phases()) {
    phase_end_s += phase.duration_s;
    accel_mm_s2 = phase.accel_mm_s2;
    if (middle_s < phase_end_s) {
      break;
    }
  }
  return {move.distance_mm(now_s) * share_xy, move.velocity_mm_s(now_s) * share_xy, accel_mm_s2};
}

// For a move with a timing of its own, which goes at even speed from passage to passage.
AlongMove by_passages(const PathPiece& piece, double time_s, double middle_s, double share_xy) {
  const std::size_t after = piece.passage_after(piece.start_s + middle_s);
  const Passage& from = piece.timing[after - 1];
  const Passage& to = piece.timing[after];
  const double lasts_s = to.time_s - from.time_s;
  return {piece.covered_xy_mm(time_s),
          lasts_s > 0.0 ? (to.covered_mm - from.covered_mm) / lasts_s * share_xy : 0.0, 0.0};
}

}  // namespace

ReferencePhase reference_phase(const PathPiece& piece, double time_s, double duration_s) {
  const planner::PlannedMove& move = piece.move;
  const double local_s = time_s - piece.start_s;
  const double middle_s = local_s + 0.5 * duration_s;
  const double share_xy = move.length_mm > 0.0 ? piece.length_xy_mm / move.length_mm : 0.0;
  const AlongMove at = piece.timing.empty() ? as_planned(move, local_s, middle_s, share_xy)
                                            : by_passages(piece, time_s, middle_s, share_xy);
  const auto along = [&](double start_mm, double direction) {
    return dynamics::BaseSegment{start_mm + direction * at.covered_mm, direction * at.speed_mm_s,
                                 direction * at.accel_mm_s2 * share_xy};
  };
  return {map_axes(along, piece.start_mm, piece.direction), piece.extruding};
}

}  // namespace unflex::verify
