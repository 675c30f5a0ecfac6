// What several tests of this folder need: plans of short programs and verification of texts.
#pragma once

#include <sstream>
#include <string>
#include <vector>

#include "unflex/gcode/interpreter.hpp"
#include "unflex/planner/klipper_planner.hpp"
#include "unflex/verify/verify.hpp"

namespace unflex::verify::testing {

struct Point {
  double x_mm;
  double y_mm;
  double feed_mm_s;
  double filament_mm = 0.0;
};

// The plan of straight moves through the points, resting at the first and the last one. The feed
// and the filament of a point are those of the move that leads there.
inline std::vector<planner::PlannedMove> plan_path(const std::vector<Point>& points,
                                                   const planner::Limits& limits) {
  planner::KlipperPlanner planner(limits, planner::FirmwareConfig{});
  gcode::Segment segment;
  segment.end_mm = {points.front().x_mm, points.front().y_mm, 0.0, 0.0};
  for (std::size_t i = 1; i < points.size(); ++i) {
    segment.start_mm = segment.end_mm;
    segment.end_mm[gcode::X] = points[i].x_mm;
    segment.end_mm[gcode::Y] = points[i].y_mm;
    segment.end_mm[gcode::E] += points[i].filament_mm;
    segment.feed_mm_s = points[i].feed_mm_s;
    segment.line = i;
    planner.add(segment);
  }
  planner.stop();
  std::vector<planner::PlannedMove> moves;
  planner.take(moves);
  return moves;
}

// The path of these moves, known up to that time. The moves must outlive it.
inline ReferencePath path_of(const std::vector<planner::PlannedMove>& moves, double until_s) {
  ReferencePath path([&moves, taken = std::size_t{0}](ReferenceMove& next) mutable {
    if (taken == moves.size()) {
      return false;
    }
    next.move = moves[taken++];
    return true;
  });
  path.begin_section();
  path.extend_to(until_s);
  return path;
}

inline NozzleXY at_rest(const std::vector<planner::PlannedMove>& moves) {
  const gcode::Position& start = moves.front().segment.start_mm;
  return {{start[gcode::X], 0.0}, {start[gcode::Y], 0.0}};
}

inline VerifyReport verify_text(const std::string& input, const std::string& output,
                                const Rules& rules = {}) {
  std::istringstream input_stream(input);
  std::istringstream output_stream(output);
  SilentProgress progress;
  Result<VerifyReport> report =
      verify(input_stream, "in.gcode", output_stream, "out.gcode", rules, progress);
  return report.has_value() ? *report : VerifyReport{};
}

// All violations as "file:line: message", one per line.
inline std::string violations_of(const VerifyReport& report) {
  std::string text;
  for (const Violation& violation : report.violations) {
    text += to_string(Error{ErrorKind::input, violation.place, violation.message}) + "\n";
  }
  return text;
}

}  // namespace unflex::verify::testing
