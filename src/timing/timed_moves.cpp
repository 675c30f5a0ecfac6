#include "timed_moves.hpp"

#include <algorithm>
#include <cmath>

#include "pieces.hpp"
#include "sections.hpp"
#include "unflex/core/xy.hpp"

namespace unflex::timing {
namespace {

// A piece of a move between two moments, at an even acceleration.
planner::PlannedMove piece_between(const planner::PlannedMove& move, double from, double to,
                                   const Progress& begin, const Progress& end) {
  planner::PlannedMove piece = part_of(move, from, to);
  const double duration_s = end.time_s - begin.time_s;
  const double mean_mm_s = piece.length_mm / duration_s;
  // The speeds at its ends do not quite fit its length and its duration.
  const double sum_mm_s = begin.speed_mm_s + end.speed_mm_s;
  const double factor = sum_mm_s > 0.0 ? 2.0 * mean_mm_s / sum_mm_s : 0.0;
  piece.start_v_mm_s = sum_mm_s > 0.0 ? factor * begin.speed_mm_s : mean_mm_s;
  piece.end_v_mm_s = sum_mm_s > 0.0 ? factor * end.speed_mm_s : mean_mm_s;
  piece.cruise_v_mm_s = std::max(piece.start_v_mm_s, piece.end_v_mm_s);
  piece.lead_s = piece.leap_mm_s = piece.accel_s = piece.cruise_s = piece.decel_s = 0.0;
  const double change_mm_s = piece.end_v_mm_s - piece.start_v_mm_s;
  piece.accel_mm_s2 = std::abs(change_mm_s) / duration_s;
  constexpr double kEven = 1e-6;
  if (std::abs(change_mm_s) <= kEven * piece.cruise_v_mm_s) {
    piece.cruise_s = duration_s;
  } else {
    (change_mm_s > 0.0 ? piece.accel_s : piece.decel_s) = duration_s;
  }
  return piece;
}

}  // namespace

Timed timed_moves(std::span<const planner::PlannedMove> path, std::span<const MoveBounds> bounds,
                  std::span<const Progress> progress) {
  Timed result;
  std::size_t next = 1;
  double path_mm = 0.0;
  // Upright moves may come before the first progress.
  Progress at = progress.front();
  at.time_s = 0.0;
  for (std::size_t i = 0; i < path.size(); ++i) {
    const planner::PlannedMove& move = path[i];
    if (is_upright(move)) {
      result.moves.push_back(from_rest_to_rest(move, bounds[i]));
      result.pieces.push_back(1);
      at.time_s += result.moves.back().duration_s();
      continue;
    }
    const double length_mm = distance(xy_of(move.segment.start_mm), xy_of(move.segment.end_mm));
    const double end_mm = path_mm + length_mm;
    const bool is_last = i + 1 == path.size();
    const std::size_t first = result.moves.size();
    double from = 0.0;
    constexpr double kNothing = 1e-6;
    const auto add = [&](const Progress& to, double share) {
      result.moves.push_back(piece_between(move, from, share, at, to));
      from = share;
      at = to;
    };
    while (next + 1 < progress.size() && progress[next].path_mm < end_mm - kNothing) {
      if (progress[next].path_mm > at.path_mm + kNothing) {
        add(progress[next], (progress[next].path_mm - path_mm) / length_mm);
      }
      ++next;
    }
    Progress end = progress[next];
    if (!is_last && end.path_mm > end_mm + kNothing) {
      const double share = (end_mm - at.path_mm) / (end.path_mm - at.path_mm);
      end.time_s = at.time_s + share * (end.time_s - at.time_s);
      end.speed_mm_s = at.speed_mm_s + share * (end.speed_mm_s - at.speed_mm_s);
    } else if (next + 1 < progress.size()) {
      ++next;
    }
    end.path_mm = end_mm;
    add(end, 1.0);
    result.pieces.push_back(result.moves.size() - first);
    path_mm = end_mm;
  }
  return result;
}

}  // namespace unflex::timing
