#include "pieces.hpp"

#include <algorithm>
#include <cmath>

namespace unflex::timing {
namespace {

// Where the move is cut, as shares of its length: 0, …, 1.
std::vector<double> cuts(double length_mm, double speed_mm_s, std::span<const double> ends_s) {
  std::vector<double> shares = {0.0};
  double at_mm = 0.0;
  for (const double end_s : ends_s) {
    const double step_mm = end_s * speed_mm_s;
    // What is left in the middle is at least as long.
    if (2.0 * (at_mm + step_mm) + step_mm >= length_mm) {
      break;
    }
    at_mm += step_mm;
    shares.push_back(at_mm / length_mm);
  }
  for (std::size_t i = shares.size(); i-- > 0;) {
    shares.push_back(1.0 - shares[i]);
  }
  return shares;
}

bool is_even(const planner::PlannedMove& move, double speed_mm_s) {
  constexpr double kSame = 1e-6;
  return std::abs(move.start_v_mm_s - speed_mm_s) < kSame * speed_mm_s &&
         std::abs(move.cruise_v_mm_s - speed_mm_s) < kSame * speed_mm_s &&
         std::abs(move.end_v_mm_s - speed_mm_s) < kSame * speed_mm_s;
}

}  // namespace

planner::PlannedMove part_of(const planner::PlannedMove& move, double from, double to) {
  planner::PlannedMove part = move;
  for (const gcode::Axis axis : {gcode::X, gcode::Y, gcode::Z, gcode::E}) {
    const double start_mm = move.segment.start_mm[axis];
    const double delta_mm = move.segment.delta(axis);
    if (from > 0.0) {
      part.segment.start_mm[axis] = start_mm + from * delta_mm;
    }
    if (to < 1.0) {
      part.segment.end_mm[axis] = start_mm + to * delta_mm;
    }
  }
  part.length_mm = move.length_mm * (to - from);
  return part;
}

Pieces in_pieces(std::span<const planner::PlannedMove> path, std::span<const MoveBounds> bounds,
                 std::span<const double> ends_s) {
  Pieces pieces;
  for (std::size_t i = 0; i < path.size(); ++i) {
    double speed_mm_s = bounds[i].speed_mm_s;
    if (i > 0) {
      speed_mm_s = std::min(speed_mm_s, bounds[i - 1].speed_mm_s);
    }
    if (i + 1 < path.size()) {
      speed_mm_s = std::min(speed_mm_s, bounds[i + 1].speed_mm_s);
    }
    const std::vector<double> shares = cuts(path[i].length_mm, speed_mm_s, ends_s);
    for (std::size_t k = 0; k + 1 < shares.size(); ++k) {
      pieces.moves.push_back(part_of(path[i], shares[k], shares[k + 1]));
      MoveBounds& own = pieces.bounds.emplace_back(bounds[i]);
      if (k > 0) {
        own.start_speed_mm_s = planner::kNoLimit;
      }
      if (k + 2 < shares.size()) {
        own.end_speed_mm_s = planner::kNoLimit;
      }
    }
    pieces.counts.push_back(shares.size() - 1);
  }
  return pieces;
}

void join_even(std::vector<planner::PlannedMove>& moves, std::vector<std::size_t>& counts) {
  std::vector<planner::PlannedMove> joined;
  joined.reserve(moves.size());
  std::size_t next = 0;
  for (std::size_t& count : counts) {
    const std::size_t first = joined.size();
    for (const std::size_t end = next + count; next < end; ++next) {
      const planner::PlannedMove& move = moves[next];
      const double speed_mm_s = move.start_v_mm_s;
      if (joined.size() > first && is_even(move, speed_mm_s) &&
          is_even(joined.back(), speed_mm_s)) {
        joined.back().segment.end_mm = move.segment.end_mm;
        joined.back().length_mm += move.length_mm;
        joined.back().cruise_s += move.cruise_s;
      } else {
        joined.push_back(move);
      }
    }
    count = joined.size() - first;
  }
  moves = std::move(joined);
}

}  // namespace unflex::timing
