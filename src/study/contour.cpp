#include "contour.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "unflex/core/foot.hpp"

namespace unflex::study {

double reach_of(double slowest_rad_s) {
  constexpr double kRoom_s = 0.02;
  return kRoom_s + std::numbers::pi / slowest_rad_s;
}

ContourGauge::ContourGauge(const std::vector<planner::PlannedMove>& moves, double reach_s)
    : reach_s_(reach_s) {
  double start_s = 0.0;
  for (const planner::PlannedMove& move : moves) {
    const XY from_mm = xy_of(move.segment.start_mm);
    const XY way_mm = xy_of(move.segment.end_mm) - from_mm;
    const double length_mm = length(way_mm);
    Edge edge{.start_s = start_s,
              .end_s = start_s + move.duration_s(),
              .from_mm = from_mm,
              .direction = {},
              .length_mm = length_mm,
              .extruding = move.segment.extruding()};
    if (length_mm > 0.0) {
      edge.direction = way_mm / length_mm;
    }
    start_s = edge.end_s;
    edges_.push_back(edge);
  }
}

ContourGauge::Reading ContourGauge::measure(double time_s, const XY& place_mm) {
  const std::size_t last = edges_.size() - 1;
  while (first_ < last && edges_[first_].end_s < time_s - reach_s_) {
    ++first_;
  }
  while (end_ < edges_.size() && (end_ <= first_ || edges_[end_].start_s <= time_s + reach_s_)) {
    ++end_;
  }
  while (current_ < last && edges_[current_].end_s <= time_s) {
    ++current_;
  }
  double best2 = std::numeric_limits<double>::infinity();
  for (std::size_t i = first_; i < end_; ++i) {
    const Edge& edge = edges_[i];
    best2 = std::min(
        best2, foot_on(place_mm - edge.from_mm, edge.direction, edge.length_mm).distance2_mm2);
  }
  return {std::sqrt(best2), edges_[current_].extruding};
}

}  // namespace unflex::study
