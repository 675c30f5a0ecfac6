#include "unflex/compensate/run.hpp"

#include <algorithm>
#include <cmath>

#include "blend.hpp"
#include "unflex/core/math.hpp"
#include "unflex/planner/plan_times.hpp"

namespace unflex::compensate {
namespace {

// Shorter cruises are left to the solver.
constexpr std::size_t kShortestCruise = 100;
// A cruise faster than this share of the largest speed leaves the base no room to settle.
constexpr double kRoomToSettle = 0.99;

std::size_t to_nodes(double time_s, double period_s) {
  return static_cast<std::size_t>(std::ceil(time_s / period_s - 1e-9));
}

// The number of nodes that are solved beyond the end of a part.
std::size_t around(const Course::Moves& moves, double period_s, const Setup& setup) {
  return static_cast<std::size_t>(std::min(planner::duration_s(moves), 2.0 * setup.overlap_s) /
                                  period_s);
}

}  // namespace

double origin_s(const Course& course, const NodeGrid& grid, const Setup& setup) {
  return course.before.empty() ? setup.lead_in_s : static_cast<double>(grid.first) * grid.period_s;
}

NodeGrid node_grid(const Course& course, const Setup& setup) {
  const double duration_s =
      (course.before.empty() ? setup.lead_in_s : 0.0) + planner::duration_s(course.moves);
  NodeGrid grid;
  std::size_t after = 0;
  if (course.after.empty()) {
    grid.period_s = setup.period_s;
    // Four nodes are the fewest that leave the base's acceleration any freedom between its ends.
    grid.last = std::max<std::size_t>(to_nodes(duration_s + setup.tail_s, setup.period_s), 3);
  } else {
    grid.last = std::max<std::size_t>(
        static_cast<std::size_t>(std::lround(duration_s / setup.period_s)), 3);
    grid.period_s = duration_s / static_cast<double>(grid.last);
    after = around(course.after, grid.period_s, setup);
  }
  grid.first = around(course.before, grid.period_s, setup);
  grid.last += grid.first;
  grid.count = grid.last + after + 1;
  return grid;
}

std::vector<WindowSpan> cut(std::size_t nodes, const Setup& setup) {
  // A core holds the halves of the blends at both its ends.
  const std::size_t core = std::max(to_nodes(setup.window_s, setup.period_s), 2 * kBlendNodes);
  const std::size_t overlap = std::max(to_nodes(setup.overlap_s, setup.period_s), kBlendNodes + 1);
  if (nodes <= core + 2 * overlap) {
    return {{0, nodes - 1, 0, nodes - 1}};
  }
  const std::size_t count = (nodes + core - 1) / core;
  std::vector<WindowSpan> spans(count);
  for (std::size_t i = 0; i < count; ++i) {
    WindowSpan& span = spans[i];
    span.core_first = i * (nodes - 1) / count;
    span.core_last = (i + 1) * (nodes - 1) / count;
    span.first = span.core_first > overlap ? span.core_first - overlap : 0;
    span.last = std::min(span.core_last + overlap, nodes - 1);
  }
  return spans;
}

namespace {

// The time after an uneven motion until base and nozzle follow an even one.
double settling_s(const Setup& setup, double period_s) {
  // Zero if jerk is not limited. If acceleration is not limited, the ratio is not finite and counts
  // as no time.
  const double longest_s = most_of_axes(
      [](const AxisSetup& axis) {
        const double ramp_s = axis.limits.max_accel_mm_s2 / axis.limits.max_jerk_mm_s3;
        return std::isfinite(ramp_s) ? 2.0 * ramp_s : 0.0;
      },
      setup);
  return std::max(setup.overlap_s + longest_s, static_cast<double>(kBlendNodes + 1) * period_s);
}

bool leaves_room(const planner::PlannedMove& move, const Setup& setup) {
  const auto fits = [&](double direction, const AxisSetup& axis) {
    return direction * move.cruise_v_mm_s <= kRoomToSettle * axis.limits.max_velocity_mm_s;
  };
  const XY direction = map_axes([](double part) { return std::abs(part); }, xy_of(move.direction));
  const bool motors_fit = !setup.shares_motors || fits(taxicab(direction), setup.x);
  return motors_fit && all_axes(fits, direction, setup);
}

// The cruises, where nothing needs solving, in the order of the course.
std::vector<WindowSpan> cruises(const Course& course, const NodeGrid& grid, const Setup& setup) {
  const double settling = settling_s(setup, grid.period_s);
  const double end_s = static_cast<double>(grid.count - 1) * grid.period_s;
  double begin_s = course.before.empty() ? setup.lead_in_s
                                         : static_cast<double>(grid.first) * grid.period_s -
                                               planner::duration_s(course.before);
  std::vector<WindowSpan> found;
  for (const Course::Moves& moves : {course.before, course.moves, course.after}) {
    for (const planner::PlannedMove& move : moves) {
      const double from_s = std::max(begin_s + move.lead_s + move.accel_s, 0.0) + settling;
      begin_s += move.duration_s();
      const double to_s = std::min(begin_s - move.decel_s, end_s) - settling;
      if (to_s - from_s < static_cast<double>(kShortestCruise) * grid.period_s ||
          !leaves_room(move, setup)) {
        continue;
      }
      const std::size_t first = to_nodes(from_s, grid.period_s);
      const std::size_t end = to_nodes(to_s, grid.period_s);
      if (first + kShortestCruise <= end) {
        found.push_back({first - kBlendNodes, end - 1 + kBlendNodes, first, end - 1, true});
      }
    }
  }
  return found;
}

}  // namespace

std::vector<WindowSpan> mesh(const Course& course, const NodeGrid& grid, const Setup& setup) {
  std::vector<WindowSpan> spans;
  const auto solve_to = [&](std::size_t last) {
    const std::size_t first = spans.empty() ? 0 : spans.back().core_last - kBlendNodes;
    for (WindowSpan span : cut(last - first + 1, setup)) {
      span = {span.first + first, span.last + first, span.core_first + first,
              span.core_last + first};
      spans.push_back(span);
    }
  };
  for (const WindowSpan& cruise : cruises(course, grid, setup)) {
    solve_to(cruise.core_first + kBlendNodes);
    spans.push_back(cruise);
  }
  solve_to(grid.count - 1);
  // Where a window and a cruise meet, both are used up to the same node.
  for (std::size_t i = 0; i < spans.size(); ++i) {
    if (spans[i].cruise) {
      spans[i - 1].core_last = spans[i].core_first;
      spans[i + 1].core_first = spans[i].core_last;
    }
  }
  return spans;
}

std::size_t windows_to_solve(const std::vector<WindowSpan>& spans) {
  return static_cast<std::size_t>(std::ranges::count(spans, false, &WindowSpan::cruise));
}

}  // namespace unflex::compensate
