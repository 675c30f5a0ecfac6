#include "unflex/rivals/axis_path.hpp"

#include <algorithm>
#include <cmath>

#include "unflex/dynamics/shaped.hpp"

namespace unflex::rivals {
namespace {

// Times closer together than this are equal.
constexpr double kSameTime_s = 1e-12;

dynamics::BaseSegment advanced(const dynamics::BaseSegment& motion, double dt) {
  return {motion.position + dt * (motion.velocity + 0.5 * dt * motion.acceleration),
          motion.velocity + dt * motion.acceleration, motion.acceleration};
}

// The motion at time t of the path, with the acceleration that holds from then on. `index` is where
// the search begins; it only grows.
dynamics::BaseSegment motion_at(const AxisPath& path, std::size_t& index, double t) {
  while (index + 1 < path.size() && path[index + 1].start_s <= t + kSameTime_s) {
    ++index;
  }
  const Parabola& piece = path[index];
  if (t + kSameTime_s < piece.start_s) {
    return {piece.motion.position, 0.0, 0.0};
  }
  return advanced(piece.motion, t - piece.start_s);
}

}  // namespace

AxisPath reference_path(const std::vector<planner::PlannedMove>& moves, gcode::Axis axis) {
  AxisPath path;
  double start_s = 0.0;
  for (const planner::PlannedMove& move : moves) {
    const double along = move.direction[axis];
    double elapsed_s = 0.0;
    for (const planner::Phase& phase : move.phases()) {
      if (phase.duration_s > 0.0) {
        path.push_back({start_s + elapsed_s,
                        {move.segment.start_mm[axis] + along * move.distance_mm(elapsed_s),
                         along * phase.speed_mm_s, along * phase.accel_mm_s2}});
        elapsed_s += phase.duration_s;
      }
    }
    start_s += move.duration_s();
  }
  path.push_back({start_s, {moves.back().segment.end_mm[axis], 0.0, 0.0}});
  return path;
}

AxisPath shaped(const AxisPath& path, const dynamics::ShaperPulses& pulses) {
  std::vector<double> starts_s;
  for (const dynamics::Pulse& pulse : pulses) {
    for (const Parabola& piece : path) {
      starts_s.push_back(piece.start_s + pulse.time_s);
    }
  }
  std::ranges::sort(starts_s);
  const auto repeated =
      std::ranges::unique(starts_s, [](double a, double b) { return b - a <= kSameTime_s; });
  starts_s.erase(repeated.begin(), repeated.end());

  AxisPath result;
  std::vector<std::size_t> index(pulses.size(), 0);
  for (const double t : starts_s) {
    result.push_back(
        {t, dynamics::shaped_at<dynamics::BaseSegment>(pulses, t, [&](std::size_t i, double at_s) {
           return motion_at(path, index[i], at_s);
         })});
  }
  return result;
}

AxisPath through_nodes(const dynamics::AxisTrajectory& nodes, double start_s, double period_s,
                       int parts) {
  AxisPath path;
  const double step_s = period_s / parts;
  const std::size_t count = nodes.position_mm.size();
  for (std::size_t k = 0; k + 1 < count; ++k) {
    for (int part = 0; part < parts; ++part) {
      const double s = part * step_s;
      const dynamics::AxisMotion from = dynamics::between(nodes, k, s, period_s);
      const dynamics::AxisMotion to = dynamics::between(nodes, k, s + step_s, period_s);
      path.push_back({start_s + static_cast<double>(k) * period_s + s,
                      {from.position_mm, from.velocity_mm_s,
                       (to.velocity_mm_s - from.velocity_mm_s) / step_s}});
    }
  }
  path.push_back(
      {start_s + static_cast<double>(count - 1) * period_s, {nodes.position_mm.back(), 0.0, 0.0}});
  return path;
}

dynamics::NozzleMotion PathCursor::at(double t) {
  const dynamics::BaseSegment motion = motion_at(*path_, index_, t);
  return {motion.position, motion.velocity};
}

double end_s(const AxisPath& path) { return path.back().start_s; }

PeakMotion peak(const AxisPath& path) {
  PeakMotion most;
  for (const Parabola& piece : path) {
    most.velocity_mm_s = std::max(most.velocity_mm_s, std::abs(piece.motion.velocity));
    most.accel_mm_s2 = std::max(most.accel_mm_s2, std::abs(piece.motion.acceleration));
  }
  return most;
}

NozzleWalk::NozzleWalk(const dynamics::FlexibleAxis& axis, const AxisPath& path, double start_s)
    : axis_(axis),
      path_(&path),
      now_s_(start_s),
      nozzle_(axis.riding(path.front().motion.position)),
      map_(axis, 0.0) {}

void NozzleWalk::step(const dynamics::BaseSegment& base, double h) {
  if (std::abs(h - map_step_s_) <= kSameTime_s) {
    map_.advance(base, nozzle_);
    return;
  }
  nozzle_ = dynamics::exact_step(axis_, nozzle_, base, h);
  if (std::abs(h - last_step_s_) <= kSameTime_s) {
    map_step_s_ = h;
    map_ = dynamics::ExactMap(axis_, h);
  }
  last_step_s_ = h;
}

const dynamics::NozzleState& NozzleWalk::at(double t) {
  const AxisPath& path = *path_;
  while (t - now_s_ > kSameTime_s) {
    const dynamics::BaseSegment base = motion_at(path, index_, now_s_);
    // The next change is the beginning of the first parabola while it is still to come, later the
    // beginning of the next parabola.
    const bool waiting = now_s_ + kSameTime_s < path[index_].start_s;
    const std::size_t next = waiting ? index_ : index_ + 1;
    const double change_s = next < path.size() ? path[next].start_s : t;
    const double to_s = std::min(change_s, t);
    step(base, to_s - now_s_);
    now_s_ = to_s;
  }
  return nozzle_;
}

std::vector<dynamics::NozzleState> nozzle_on(const dynamics::FlexibleAxis& axis,
                                             const AxisPath& path, const TimeGrid& grid) {
  std::vector<dynamics::NozzleState> result;
  result.reserve(grid.count);
  NozzleWalk walk(axis, path, grid.start_s);
  for (std::size_t k = 0; k < grid.count; ++k) {
    result.push_back(walk.at(grid.at(k)));
  }
  return result;
}

double start_s(const Axes<AxisPath>& paths) {
  return least_of_axes([](const AxisPath& path) { return path.front().start_s; }, paths);
}

double end_s(const Axes<AxisPath>& paths) {
  return most_of_axes([](const AxisPath& path) { return end_s(path); }, paths);
}

NozzleWalkXY::NozzleWalkXY(const Axes<dynamics::FlexibleAxis>& axes, const Axes<AxisPath>& paths,
                           double start_s)
    : walks_(map_axes([&](const dynamics::FlexibleAxis& axis,
                          const AxisPath& path) { return NozzleWalk(axis, path, start_s); },
                      axes, paths)) {}

XY NozzleWalkXY::place_mm(double t) {
  XY result;
  for_each_axis([&](double& own_mm, NozzleWalk& walk) { own_mm = walk.at(t).position(); }, result,
                walks_);
  return result;
}

}  // namespace unflex::rivals
