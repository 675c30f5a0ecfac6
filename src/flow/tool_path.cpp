#include "tool_path.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace unflex::flow {
namespace {

using kinematics::Point;

// A leg may be too short in the middle of a move whose ends it reaches. It is looked at this often.
constexpr double kLook_mm = 1.0;
constexpr double kMostLooks = 1000.0;
// A machine that asks for shorter lines than this is nearly singular.
constexpr double kShortestLine_mm = 1e-3;

Point place_on(const Point& from, const Point& to, double share) {
  Point p = to;
  for (std::size_t i = 0; i < p.size() && share < 1.0; ++i) {
    p[i] = from[i] + share * (to[i] - from[i]);
  }
  return p;
}

std::optional<std::string> why_not_along(const kinematics::Machine& machine, const Point& from,
                                         const Point& to, double length_mm) {
  const double looks = std::clamp(std::ceil(length_mm / kLook_mm), 1.0, kMostLooks);
  for (double look = 0.0; look <= looks; ++look) {
    if (auto why = why_not_at(machine, place_on(from, to, look / looks))) {
      return why;
    }
  }
  return std::nullopt;
}

// The shares of a segment at which its lines end.
tl::expected<std::vector<double>, std::string> ends_of_lines(const kinematics::Machine& machine,
                                                             const Point& from, const Point& to,
                                                             double length_mm,
                                                             double tolerance_mm) {
  std::vector<double> shares;
  const Point way = {to[0] - from[0], to[1] - from[1], to[2] - from[2]};
  double done_mm = 0.0;
  while (!is_uniform(machine) && length_mm > 0.0) {
    const Point p = place_on(from, to, done_mm / length_mm);
    const double rest_mm = length_mm - done_mm;
    const double longest_mm = longest_line_mm(machine, p, way, tolerance_mm);
    if (longest_mm >= rest_mm) {
      break;
    }
    if (!(longest_mm > kShortestLine_mm)) {
      return tl::unexpected(fmt::format(
          "near X{:.6g} Y{:.6g} Z{:.6g} the machine is nearly singular", p[0], p[1], p[2]));
    }
    // Two equal lines at the end are better than a long one and a scrap.
    done_mm += std::min(longest_mm, 0.5 * rest_mm);
    shares.push_back(done_mm / length_mm);
  }
  shares.push_back(1.0);
  return shares;
}

}  // namespace

std::optional<std::string> why_not_at(const kinematics::Machine& machine, const Point& p) {
  std::optional<std::string> why = fault(machine, p);
  if (why) {
    why = fmt::format("the tool cannot be at X{:.6g} Y{:.6g} Z{:.6g}: {}", p[0], p[1], p[2], *why);
  }
  return why;
}

Point place_of(const gcode::Position& position) {
  return {position[gcode::X], position[gcode::Y], position[gcode::Z]};
}

bool moves_tool(const gcode::Event& event) {
  return std::ranges::any_of(
      event.segments, [](const gcode::Segment& segment) { return segment.length_mm() > 0.0; });
}

tl::expected<std::vector<ToolLine>, std::string> tool_lines(
    const kinematics::Machine& machine, const std::vector<gcode::Segment>& segments,
    double tolerance_mm) {
  std::vector<ToolLine> lines;
  const double first_e = segments.front().start_mm[gcode::E];
  const double all_e = segments.back().end_mm[gcode::E] - first_e;
  for (const gcode::Segment& segment : segments) {
    const Point from = place_of(segment.start_mm);
    const Point to = place_of(segment.end_mm);
    const double length_mm = segment.length_mm();
    if (auto why = why_not_along(machine, from, to, length_mm)) {
      return tl::unexpected(std::move(*why));
    }
    const auto shares = ends_of_lines(machine, from, to, length_mm, tolerance_mm);
    if (!shares) {
      return tl::unexpected(shares.error());
    }
    double before = 0.0;
    for (const double share : *shares) {
      ToolLine line;
      line.end_mm = place_on(from, to, share);
      const auto joints = to_joints(machine, line.end_mm);
      if (!joints) {
        return tl::unexpected(joints.error().message);
      }
      line.end_joints_mm = *joints;
      line.length_mm = (share - before) * length_mm;
      const double e = segment.start_mm[gcode::E] + share * segment.delta(gcode::E) - first_e;
      line.share_of_e = all_e != 0.0 ? e / all_e : 1.0;
      lines.push_back(line);
      before = share;
    }
  }
  lines.back().share_of_e = 1.0;
  return lines;
}

}  // namespace unflex::flow
