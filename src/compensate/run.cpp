#include "unflex/compensate/run.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "contour.hpp"
#include "limits.hpp"
#include "mode_motors.hpp"
#include "shared_motors.hpp"
#include "unflex/core/math.hpp"
#include "unflex/planner/plan_times.hpp"

namespace unflex::compensate {
namespace {

// Half the number of nodes over which two windows are blended.
constexpr std::size_t kBlendNodes = 10;
// Shorter cruises are left to the solver.
constexpr std::size_t kShortestCruise = 100;
// A cruise faster than this share of the largest speed leaves the base no room to settle.
constexpr double kRoomToSettle = 0.99;

// r and its weight; times must not decrease from call to call.
class Reference {
 public:
  // origin_s: when the course's own moves begin.
  Reference(const Course& course, double origin_s, const Setup& setup)
      : travel_weight_(setup.travel_weight), starts_s_{origin_s} {
    for (const planner::PlannedMove& move : course.before) {
      starts_s_.front() -= move.duration_s();
    }
    for (const Course::Moves& moves : {course.before, course.moves, course.after}) {
      for (const planner::PlannedMove& move : moves) {
        moves_.push_back(&move);
        starts_s_.push_back(starts_s_.back() + move.duration_s());
      }
    }
  }

  struct Sample {
    XY place_mm;
    double weight;
  };

  Sample at(double t) {
    now_ = planner::move_at(starts_s_, t, now_);
    const planner::PlannedMove& move = *moves_[now_];
    const bool moving = t >= starts_s_[now_] && t <= starts_s_[now_ + 1];
    return {xy_of(move.position_mm(t - starts_s_[now_])),
            moving && move.segment.extruding() ? 1.0 : travel_weight_};
  }

 private:
  double travel_weight_;
  std::vector<const planner::PlannedMove*> moves_;
  std::vector<double> starts_s_;
  std::size_t now_ = 0;
};

std::size_t to_nodes(double time_s, double period_s) {
  return static_cast<std::size_t>(std::ceil(time_s / period_s - 1e-9));
}

// The number of nodes that are solved beyond the end of a part.
std::size_t around(const Course::Moves& moves, double period_s, const Setup& setup) {
  return static_cast<std::size_t>(std::min(planner::duration_s(moves), 2.0 * setup.overlap_s) /
                                  period_s);
}

// One axis of a window, without the conditions at the window's ends.
AxisWindow make_axis(const AxisSetup& axis, const Setup& setup, double period_s,
                     std::vector<double> reference, std::vector<double> weight) {
  AxisWindow window;
  window.axis = axis.axis;
  window.plants = axis.plants;
  window.period_s = period_s;
  // The effect of the base's jerk on the nozzle's motion goes with (ωh)². With this weight one
  // value serves all resonances.
  window.jerk_weight = setup.jerk_weight * math::power(axis.axis.main_rad_s() * period_s, 4);
  window.limits = axis.limits;
  // If the sliced path itself leaves the travel, the base may go as far but no further.
  const auto [low, high] = std::ranges::minmax(reference);
  window.limits.min_position_mm = std::min(window.limits.min_position_mm, low);
  window.limits.max_position_mm = std::max(window.limits.max_position_mm, high);
  window.reference_mm = std::move(reference);
  window.weight = std::move(weight);
  return window;
}

// Takes the frequencies over the bed into an axis' window. places_mm: r of all axes at its samples.
// Where the frequencies hardly change, their mean serves the whole window.
void take_field(const dynamics::FrequencyField& field, const Axes<std::vector<double>>& places_mm,
                AxisWindow& window) {
  constexpr double kHardly = 2e-3;
  if (field.is_even()) {
    return;
  }
  std::vector<double> shares;
  for (std::size_t i = 0; i < places_mm.x.size(); ++i) {
    shares.push_back(field.at({places_mm.x[i], places_mm.y[i]}));
  }
  const auto [low, high] = std::ranges::minmax(shares);
  if (high > (1.0 + kHardly) * low) {
    window.freq_shares = std::move(shares);
    return;
  }
  const double mean = 0.5 * (low + high);
  window.axis = window.axis.detuned(mean);
  for (Plant& plant : window.plants) {
    plant.axis = plant.axis.detuned(mean);
  }
}

// A place in the coordinates in which the setup's axes are apart. Heights count from the plan's.
std::array<double, 3> in_coordinates(const Setup& setup, const XY& place_mm) {
  const std::array<double, 3> place = {place_mm.x, place_mm.y, 0.0};
  return setup.frame ? setup.frame->to_modes(place) : place;
}

dynamics::NozzleState start_of_mode(const dynamics::NozzleXY& nozzle, std::size_t mode,
                                    double base_mm) {
  const dynamics::NozzleMotion& part = nozzle.x.parts[mode];
  return {{dynamics::NozzleMotion{base_mm + part.position, part.velocity}}};
}

// The nozzle at the beginning of a window whose base rests at base_mm. Both are in the coordinates
// in which the setup's axes are apart.
dynamics::NozzleXY start_of(const dynamics::NozzleXY& nozzle, const Setup& setup,
                            const XY& base_mm) {
  if (!setup.frame) {
    return nozzle;
  }
  dynamics::NozzleXY start;
  for (std::size_t i = 0; i < XY::kCount; ++i) {
    start[i] = start_of_mode(nozzle, i, base_mm[i]);
  }
  return start;
}

// Raises the weights around the end of a run. first_sample: where they begin.
void weigh_end(const Course& course, const Setup& setup, const NodeGrid& grid,
               std::size_t first_sample, std::vector<double>& weight) {
  constexpr double kAroundEnd_s = 3e-3;
  const double end_s = origin_s(course, grid, setup) + planner::duration_s(course.moves);
  for (std::size_t i = 0; i < weight.size(); ++i) {
    const double t = 0.5 * static_cast<double>(first_sample + i) * grid.period_s;
    if (std::abs(t - end_s) <= kAroundEnd_s) {
      weight[i] = std::max(weight[i], setup.end_weight);
    }
  }
}

}  // namespace

Plant AxisWindow::model(std::size_t i) const {
  if (i > 0) {
    return plants[i - 1];
  }
  double share = 1.0;
  for (const Plant& plant : plants) {
    share -= plant.share;
  }
  return {axis, share};
}

dynamics::NozzleState AxisWindow::in_model(std::size_t i, const dynamics::NozzleState& nozzle,
                                           double base_mm) const {
  const dynamics::FlexibleAxis& other = i > 0 ? plants[i - 1].axis : axis;
  return other.swinging_as(axis, nozzle, base_mm);
}

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

std::vector<RunWindow> windows(const Course& course, const std::vector<WindowSpan>& spans,
                               const dynamics::NozzleXY& nozzle, const Setup& setup) {
  return windows(course, spans, 0, spans.size(), nozzle, setup);
}

std::vector<RunWindow> windows(const Course& course, const std::vector<WindowSpan>& spans,
                               std::size_t first, std::size_t count,
                               const dynamics::NozzleXY& nozzle, const Setup& setup) {
  const NodeGrid grid = node_grid(course, setup);
  // Twice as many samples as nodes, from the first node of the first window.
  const std::size_t first_sample = 2 * spans[first].first;
  const std::size_t last_sample = 2 * spans[first + count - 1].last;
  Axes<std::vector<double>> reference_mm;
  std::vector<double> third_mm;
  std::vector<double> weight;
  const bool from_rest = course.before.empty();
  Reference reference(course, origin_s(course, grid, setup), setup);
  for (std::size_t i = first_sample; i <= last_sample; ++i) {
    const Reference::Sample sample = reference.at(0.5 * static_cast<double>(i) * grid.period_s);
    const std::array<double, 3> place_mm = in_coordinates(setup, sample.place_mm);
    for_each_axis([](std::vector<double>& all, double place) { all.push_back(place); },
                  reference_mm, xy_of(place_mm));
    third_mm.push_back(place_mm[2]);
    weight.push_back(sample.weight);
  }
  if (course.after.empty()) {
    weigh_end(course, setup, grid, first_sample, weight);
  }
  std::vector<PathVertex> path;
  if (setup.contour) {
    path = path_of(course, origin_s(course, grid, setup), grid.period_s);
  }
  std::vector<RunWindow> result;
  for (std::size_t w = first; w < first + count; ++w) {
    const WindowSpan& span = spans[w];
    const auto slice = [&](const std::vector<double>& all) {
      return std::vector<double>(
          all.begin() + static_cast<std::ptrdiff_t>(2 * span.first - first_sample),
          all.begin() + static_cast<std::ptrdiff_t>(2 * span.last + 1 - first_sample));
    };
    const Axes<std::vector<double>> places_mm = map_axes(slice, reference_mm);
    RunWindow window{map_axes(
                         [&](const AxisSetup& axis, const std::vector<double>& of_axis_mm) {
                           AxisWindow made =
                               make_axis(axis, setup, grid.period_s, of_axis_mm, slice(weight));
                           take_field(axis.field, places_mm, made);
                           return made;
                         },
                         setup, places_mm),
                     setup.shares_motors,
                     setup.contour,
                     {},
                     setup.frame};
    if (setup.contour) {
      window.path = part_of(path, 2 * span.first, window.x.reference_mm.size(),
                            2.0 * setup.contour->reach_s / grid.period_s);
    }
    if (setup.third) {
      window.third = make_axis(*setup.third, setup, grid.period_s, slice(third_mm), slice(weight));
      window.motors = setup.motors;
    }
    if (from_rest && span.first == 0) {
      for_each_axis(
          [](AxisWindow& axis, const dynamics::NozzleState& state) {
            axis.start = AxisWindow::Start{state, axis.reference_mm.front()};
          },
          window,
          start_of(nozzle, setup, {window.x.reference_mm.front(), window.y.reference_mm.front()}));
    }
    if (window.third && from_rest && span.first == 0) {
      const double at_mm = window.third->reference_mm.front();
      window.third->start = AxisWindow::Start{start_of_mode(nozzle, 2, at_mm), at_mm};
    }
    if (course.after.empty() && span.last == spans.back().last) {
      const auto rest = [](AxisWindow& axis) { axis.end_base_mm = axis.reference_mm.back(); };
      for_each_axis(rest, window);
      if (window.third) {
        rest(*window.third);
      }
    }
    result.push_back(std::move(window));
  }
  return result;
}

AxisSolution along(const AxisWindow& window) {
  const std::size_t nodes = window.nodes();
  const double duration_s = static_cast<double>(nodes - 1) * window.period_s;
  AxisSolution solution;
  for (std::size_t k = 0; k < nodes; ++k) {
    solution.base.position_mm.push_back(window.reference_mm[2 * k]);
  }
  solution.base.velocity_mm_s.assign(
      nodes, (window.reference_mm.back() - window.reference_mm.front()) / duration_s);
  solution.base.accel_mm_s2.assign(nodes, 0.0);
  return solution;
}

void prepare(const Engine& divider, const WindowSpan& span, RunWindow& window) {
  if (span.cruise) {
    return;
  }
  if (window.contour) {
    static_cast<void>(aim(window));
  }
  if (window.shares_motors) {
    // The solution is dropped. Only the limits that it has set in the window count.
    static_cast<void>(solve_with_shared_motors(divider, window));
  }
}

AxisSolutions solve(const Engine& engine, const WindowSpan& span, RunWindow& window) {
  if (span.cruise) {
    const auto cruise = [](const AxisWindow& axis) { return Result<AxisSolution>(along(axis)); };
    AxisSolutions solutions{map_axes(cruise, window)};
    if (window.third) {
      solutions.third = cruise(*window.third);
    }
    return solutions;
  }
  if (window.third) {
    return solve_modes(engine, window);
  }
  const FreeSolutions free = window.contour ? aim(window) : FreeSolutions{};
  if (window.shares_motors) {
    return solve_with_shared_motors(engine, window);
  }
  const auto solved = [&](const AxisWindow& axis, const std::optional<AxisSolution>& without) {
    // A solution that keeps the limits by itself is the one within them, too.
    return without && broken(without->base, axis) == ActiveLimits{} ? Result<AxisSolution>(*without)
                                                                    : engine.solve(axis);
  };
  return {map_axes(solved, window, free)};
}

Result<dynamics::BaseTrajectory> solve_all(const Engine& engine,
                                           const std::vector<WindowSpan>& spans,
                                           std::vector<RunWindow>& windows,
                                           const std::function<void(const AxisSolution&)>& each) {
  Axes<std::vector<dynamics::AxisTrajectory>> solutions;
  std::vector<dynamics::AxisTrajectory> thirds;
  for (std::size_t i = 0; i < windows.size(); ++i) {
    AxisSolutions solved = solve(engine, spans[i], windows[i]);
    if (solved.third) {
      if (!*solved.third) {
        return tl::unexpected(std::move(solved.third->error()));
      }
      thirds.push_back(std::move((*solved.third)->base));
    }
    for (std::size_t axis = 0; axis < solved.kCount; ++axis) {
      if (!solved[axis]) {
        return tl::unexpected(std::move(solved[axis].error()));
      }
      if (each) {
        each(*solved[axis]);
      }
      solutions[axis].push_back(std::move(solved[axis]->base));
    }
  }
  dynamics::BaseTrajectory base{
      map_axes([&](const auto& of_axis) { return join(spans, of_axis); }, solutions),
      windows.front().x.period_s};
  if (!windows.front().frame) {
    return base;
  }
  return in_axes(*windows.front().frame, base,
                 thirds.empty() ? std::nullopt : std::optional(join(spans, thirds)),
                 windows.front().motors.value_or(ModeMotors{}).max_z_accel_mm_s2);
}

namespace {

// The motion times a share s(t) ≤ 1 that changes slowly, so small that no acceleration is above the
// limit: z̈ → s z̈ + 2 ṡ ż + s̈ z, of which the first part is by far the largest.
void keep_z_accel(double most_mm_s2, double period_s, dynamics::AxisTrajectory& z) {
  constexpr double kSlow_s = 0.03;
  const std::size_t nodes = z.accel_mm_s2.size();
  const auto reach = static_cast<std::size_t>(kSlow_s / period_s);
  const auto around = [&](std::size_t k) {
    return std::pair(k - std::min(k, reach), std::min(k + reach, nodes - 1));
  };
  std::vector<double> needed(nodes, 1.0);
  for (std::size_t k = 0; k < nodes; ++k) {
    needed[k] = std::min(1.0, most_mm_s2 / std::abs(z.accel_mm_s2[k]));
  }
  if (std::ranges::min(needed) >= 1.0) {
    return;
  }
  // The least share that is needed within the reach, and its mean within the reach, twice.
  std::vector<double> share(nodes);
  for (std::size_t k = 0; k < nodes; ++k) {
    const auto [first, last] = around(k);
    share[k] = *std::min_element(needed.begin() + static_cast<std::ptrdiff_t>(first),
                                 needed.begin() + static_cast<std::ptrdiff_t>(last) + 1);
  }
  std::vector<double> smooth(nodes);
  for (std::size_t k = 0; k < nodes; ++k) {
    const auto [first, last] = around(k);
    double sum = 0.0;
    double weights = 0.0;
    for (std::size_t i = first; i <= last; ++i) {
      const double part = static_cast<double>(i) - static_cast<double>(k);
      const double weight = 1.0 - std::abs(part) / (static_cast<double>(reach) + 1.0);
      sum += weight * share[i];
      weights += weight;
    }
    smooth[k] = sum / weights;
  }
  const dynamics::AxisTrajectory whole = z;
  for (std::size_t k = 0; k < nodes; ++k) {
    const std::size_t before = k > 0 ? k - 1 : k;
    const std::size_t after = k + 1 < nodes ? k + 1 : k;
    const double rate =
        (smooth[after] - smooth[before]) / (static_cast<double>(after - before) * period_s);
    z.position_mm[k] = smooth[k] * whole.position_mm[k];
    z.velocity_mm_s[k] = smooth[k] * whole.velocity_mm_s[k] + rate * whole.position_mm[k];
    z.accel_mm_s2[k] = smooth[k] * whole.accel_mm_s2[k] + 2.0 * rate * whole.velocity_mm_s[k];
  }
}

}  // namespace

dynamics::BaseTrajectory in_axes(const dynamics::ModeFrame& frame,
                                 const dynamics::BaseTrajectory& in_modes,
                                 const std::optional<dynamics::AxisTrajectory>& third,
                                 double max_z_accel_mm_s2) {
  dynamics::BaseTrajectory base = in_modes;
  base.above = third;
  for (const auto member :
       {&dynamics::AxisTrajectory::position_mm, &dynamics::AxisTrajectory::velocity_mm_s,
        &dynamics::AxisTrajectory::accel_mm_s2}) {
    for (std::size_t k = 0; k < base.nodes(); ++k) {
      double& x = (base.x.*member)[k];
      double& y = (base.y.*member)[k];
      const auto at = frame.to_axes({x, y, third ? ((*third).*member)[k] : 0.0});
      x = at[0];
      y = at[1];
      if (base.above) {
        ((*base.above).*member)[k] = at[2];
      }
    }
  }
  if (base.above) {
    keep_z_accel(max_z_accel_mm_s2, base.period_s, *base.above);
  }
  return base;
}

dynamics::AxisTrajectory join(const std::vector<WindowSpan>& spans,
                              const std::vector<dynamics::AxisTrajectory>& solutions) {
  dynamics::AxisTrajectory joined = solutions.front();
  for (std::size_t i = 1; i < spans.size(); ++i) {
    const std::size_t seam = spans[i].core_first;
    const dynamics::AxisTrajectory& next = solutions[i];
    joined.position_mm.resize(spans[i].last + 1);
    joined.velocity_mm_s.resize(spans[i].last + 1);
    joined.accel_mm_s2.resize(spans[i].last + 1);
    for (std::size_t k = seam - kBlendNodes; k <= spans[i].last; ++k) {
      const double s = std::min(
          static_cast<double>(k - (seam - kBlendNodes)) / static_cast<double>(2 * kBlendNodes),
          1.0);
      const double share = s * s * (3.0 - 2.0 * s);  // of the next window
      const auto blend = [&](std::vector<double>& into, const std::vector<double>& from) {
        const double other = from[k - spans[i].first];
        into[k] = s < 1.0 ? into[k] + share * (other - into[k]) : other;
      };
      blend(joined.position_mm, next.position_mm);
      blend(joined.velocity_mm_s, next.velocity_mm_s);
      blend(joined.accel_mm_s2, next.accel_mm_s2);
    }
  }
  return joined;
}

}  // namespace unflex::compensate
