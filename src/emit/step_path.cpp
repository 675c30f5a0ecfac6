// The run as stretches that are searched (step_search.hpp) and leaps between them (leaps.hpp).
#include "step_path.hpp"

#include <algorithm>
#include <span>

#include "leaps.hpp"
#include "line_fan.hpp"
#include "step_search.hpp"

namespace unflex::emit {
namespace {

// Where the run begins.
template <int kModes>
State<kModes> start_of(const RunEnds& ends, const LineCosts<kModes>& costs, const StepGrid& grid,
                       const LineRules& rules) {
  State<kModes> state;
  state.at = grid.nearest(vector(ends.start_mm));
  for (std::size_t axis = 0; axis < XY::kCount; ++axis) {
    state.z[place_of_o<kModes>(axis)] =
        ends.start_mm[axis] - costs.base_mm(0)[static_cast<Eigen::Index>(axis)];
  }
  if (ends.goes_on) {
    state.speed_mm_s = (costs.base_mm(1) - costs.base_mm(0)) / costs.dt_s();
    state.line_s = rules.even_line_s();
  }
  return state;
}

// z of nozzles that go along with a line. off_mm, off_mm_s: how far the line is off the base, and
// how fast that changes.
template <int kModes>
ZVector<kModes> going_along(const LineCosts<kModes>& costs, const Eigen::Vector2d& off_mm,
                            const Eigen::Vector2d& off_mm_s) {
  ZVector<kModes> z;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const auto a = static_cast<Eigen::Index>(axis);
    z.template segment<2 * kModes>(a * kOfAxis<kModes>) =
        costs.riding(axis, off_mm[a], off_mm_s[a]);
    z[place_of_o<kModes>(axis)] = off_mm[a];
  }
  return z;
}

// The state at the end of a leap, all along which the nozzle has followed the line.
template <int kModes>
State<kModes> end_of(const Leap& leap, const LineCosts<kModes>& costs, const StepGrid& grid) {
  const double duration_s = costs.time_s(leap.until) - costs.time_s(leap.from);
  const Eigen::Vector2d before = grid.mm(leap.begin) - costs.base_mm(leap.from);
  const Eigen::Vector2d off = grid.mm(leap.end) - costs.base_mm(leap.until);
  State<kModes> state;
  state.z = going_along<kModes>(costs, off, (off - before) / duration_s);
  state.at = leap.end;
  state.speed_mm_s = (grid.mm(leap.end) - grid.mm(leap.begin)) / duration_s;
  state.line_s = duration_s;
  state.k = leap.until;
  return state;
}

Polygon single_place(double time_s, const Eigen::Vector2d& place_mm) {
  Polygon polygon{{time_s}, {}};
  polygon.add(xy_of(place_mm));
  return polygon;
}

void append(const Polygon& part, Polygon& all) {
  all.times_s.insert(all.times_s.end(), part.times_s.begin(), part.times_s.end());
  for_each_axis(
      [](std::vector<double>& all_mm, const std::vector<double>& part_mm) {
        all_mm.insert(all_mm.end(), part_mm.begin(), part_mm.end());
      },
      all.places_mm, part.places_mm);
}

// The mean over the nozzles of J along these lines.
template <int kModes>
double cost_of(const Polygon& polygon, const LineCosts<kModes>& costs, const State<kModes>& start,
               const LineRules& rules) {
  const auto candidate = [&](std::size_t i) {
    return static_cast<std::size_t>(nearest_whole(polygon.times_s[i] / costs.dt_s()));
  };
  const auto longest = static_cast<std::size_t>(rules.max_line_s / costs.dt_s() + 1e-9);
  LineFan<kModes> fan(costs);
  ZVector<kModes> z = start.z;
  double sum = 0.0;
  for (std::size_t i = 1; i < polygon.times_s.size(); ++i) {
    const std::size_t k = candidate(i - 1);
    const std::size_t m = candidate(i) - k;
    const Eigen::Vector2d to = vector(polygon.place_mm(i));
    const Eigen::Vector2d way = to - vector(polygon.place_mm(i - 1));
    if (m > longest) {
      // A leap, at whose end the nozzle goes along with the line.
      const double duration_s = costs.dt_s() * static_cast<double>(m);
      z = going_along<kModes>(costs, to - costs.base_mm(k + m),
                              (way - (costs.base_mm(k + m) - costs.base_mm(k))) / duration_s);
      continue;
    }
    fan.begin(k, std::span(&z, 1));
    fan.reach(m);
    const Eigen::Vector2d speed = way / fan.duration_s();
    sum += fan.cost(0, speed);
    z = fan.after(0, speed);
  }
  return sum;
}

template <int kModes>
Polygon path_of(const dynamics::BaseTrajectory& base, const std::vector<double>& wanted,
                const std::function<ErrorWeight(double)>& weight, const RunEnds& ends,
                const Axes<AxisGrid>& axes, const LineRules& rules) {
  const LineCosts<kModes> costs(base, weight, rules);
  const StepGrid grid(axes);
  const auto candidate = [&](double t) {
    return std::min(static_cast<std::size_t>(nearest_whole(t / costs.dt_s())), costs.size() - 1);
  };
  const std::size_t last = ends.until_s ? candidate(*ends.until_s) : costs.size() - 1;
  std::vector<std::size_t> wanted_at;
  for (const double t : wanted) {
    wanted_at.push_back(candidate(t));
  }
  const Place end = grid.nearest(vector(ends.end_mm));
  Polygon all;
  std::vector<double> lines_before_s = ends.lines_before_s;
  const auto go_on = [&](const Stretch<kModes>& stretch) {
    // A leap may begin or end where the run does.
    const Polygon part = stretch.begin.k == stretch.last
                             ? single_place(costs.time_s(stretch.last), grid.mm(stretch.end))
                             : search(costs, wanted_at, stretch, grid, rules, lines_before_s);
    append(part, all);
    lines_before_s = all.times_s;
    return !part.times_s.empty();
  };
  const State<kModes> start = start_of(ends, costs, grid, rules);
  State<kModes> begin = start;
  for (const Leap& leap : leaps(costs, wanted_at, begin.at, last, end, grid, rules)) {
    if (!go_on({begin, leap.from, leap.begin, true, 0})) {
      return {};
    }
    begin = end_of(leap, costs, grid);
  }
  if (!go_on({begin, last, end, ends.until_s.has_value(), ends.lines_after})) {
    return {};
  }
  if constexpr (kModes % 2 == 0) {
    // Lines for two nozzles may leave much in both. Those for the expected nozzle may leave less.
    constexpr double kMuch_mm = 2e-3;
    if (costs.nozzles() == 2) {
      const double cost = cost_of(all, costs, start, rules);
      if (2.0 * cost > kMuch_mm * kMuch_mm * all.times_s.back()) {
        LineRules exact = rules;
        exact.freq_error = 0.0;
        Polygon other = path_of<kModes / 2>(base, wanted, weight, ends, axes, exact);
        if (!other.times_s.empty() && cost_of(other, costs, start, rules) < cost) {
          return other;
        }
      }
    }
  }
  return all;
}

}  // namespace

Polygon step_path(const dynamics::BaseTrajectory& base, const std::vector<double>& wanted,
                  const std::function<ErrorWeight(double)>& weight, const RunEnds& ends,
                  const Axes<AxisGrid>& grid, const LineRules& rules) {
  const std::size_t modes = most_of_axes(
      [](const dynamics::FlexibleAxis& axis) { return axis.mode_count(); }, rules.nozzle);
  return with_modes(modes, [&](auto count) {
    constexpr int kModes = decltype(count)::value;
    return nozzles_for(rules) == 1 ? path_of<kModes>(base, wanted, weight, ends, grid, rules)
                                   : path_of<2 * kModes>(base, wanted, weight, ends, grid, rules);
  });
}

}  // namespace unflex::emit
