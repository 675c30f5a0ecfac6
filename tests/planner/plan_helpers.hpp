// Short ways to make segments and plans.
#pragma once

#include <vector>

#include "unflex/planner/klipper_planner.hpp"

namespace unflex::planner::testing {

inline gcode::Segment segment(gcode::Position start_mm, gcode::Position end_mm, double feed_mm_s) {
  gcode::Segment result;
  result.start_mm = start_mm;
  result.end_mm = end_mm;
  result.feed_mm_s = feed_mm_s;
  return result;
}

// Straight moves from the origin through the given points, all at one feed.
inline std::vector<gcode::Segment> polyline(const std::vector<gcode::Position>& points_mm,
                                            double feed_mm_s) {
  std::vector<gcode::Segment> result;
  gcode::Position at{};
  for (const gcode::Position& point : points_mm) {
    result.push_back(segment(at, point, feed_mm_s));
    at = point;
  }
  return result;
}

// The plan of segments that begin and end at a standstill.
inline std::vector<PlannedMove> plan(const std::vector<gcode::Segment>& segments, Limits limits,
                                     FirmwareConfig fixed = {}) {
  KlipperPlanner planner(limits, fixed);
  for (const gcode::Segment& each : segments) planner.add(each);
  planner.stop();
  std::vector<PlannedMove> result;
  planner.take(result);
  return result;
}

}  // namespace unflex::planner::testing
