#include "contour.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "unflex/core/math.hpp"

namespace unflex::study {

double reach_of(double slowest_rad_s) {
  constexpr double kRoom_s = 0.02;
  return kRoom_s + std::numbers::pi / slowest_rad_s;
}

ContourGauge::ContourGauge(const std::vector<planner::PlannedMove>& moves, double reach_s)
    : reach_s_(reach_s) {
  double start_s = 0.0;
  for (const planner::PlannedMove& move : moves) {
    const gcode::Position& from = move.segment.start_mm;
    const gcode::Position& to = move.segment.end_mm;
    const double dx = to[gcode::X] - from[gcode::X];
    const double dy = to[gcode::Y] - from[gcode::Y];
    const double length = math::hypot(dx, dy);
    Edge edge{.start_s = start_s,
              .end_s = start_s + move.duration_s(),
              .x_mm = from[gcode::X],
              .y_mm = from[gcode::Y],
              .length_mm = length,
              .extruding = move.segment.extruding()};
    if (length > 0.0) {
      edge.direction_x = dx / length;
      edge.direction_y = dy / length;
    }
    start_s = edge.end_s;
    edges_.push_back(edge);
  }
}

ContourGauge::Reading ContourGauge::measure(double time_s, double x_mm, double y_mm) {
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
    const double x = x_mm - edge.x_mm;
    const double y = y_mm - edge.y_mm;
    const double along =
        std::clamp(x * edge.direction_x + y * edge.direction_y, 0.0, edge.length_mm);
    const double across_x = x - along * edge.direction_x;
    const double across_y = y - along * edge.direction_y;
    best2 = std::min(best2, across_x * across_x + across_y * across_y);
  }
  return {std::sqrt(best2), edges_[current_].extruding};
}

}  // namespace unflex::study
