// The motion of one axis as a row of parabolas: the base's motion by any method, and the motion of
// the nozzle that hangs on it.
//
//   b, p   base and nozzle       r   reference, the plan's own motion
#pragma once

#include <cstddef>
#include <vector>

#include "unflex/core/axes.hpp"
#include "unflex/core/problem_size.hpp"
#include "unflex/core/xy.hpp"
#include "unflex/dynamics/base_trajectory.hpp"
#include "unflex/dynamics/flexible_axis.hpp"
#include "unflex/dynamics/shapers.hpp"
#include "unflex/gcode/interpreter.hpp"
#include "unflex/planner/planner.hpp"

namespace unflex::rivals {

// A motion that holds until the next parabola begins.
struct Parabola {
  double start_s = 0.0;
  dynamics::BaseSegment motion;
};

// In order of time and not empty. Before the first parabola the axis rests where that one begins.
// The last parabola lasts for ever.
using AxisPath = std::vector<Parabola>;

// A path that a method found by solving equations.
struct SolvedPath {
  AxisPath path;
  ProblemSize size;
  int iterations = 0;  // systems of equations solved on the way
};

// r(t) of a plan that starts at rest at time 0 and ends at rest.
[[nodiscard]] AxisPath reference_path(const std::vector<planner::PlannedMove>& moves,
                                      gcode::Axis axis);

// X and Y of a function of moves and an axis, such as reference_path().
template <typename F>
[[nodiscard]] auto on_axes_of(const std::vector<planner::PlannedMove>& moves, const F& path_of) {
  constexpr Axes<gcode::Axis> kNumbers{gcode::X, gcode::Y};
  return map_axes([&](gcode::Axis axis) { return path_of(moves, axis); }, kNumbers);
}

// Σ weight · b(t − time_s), exactly.
[[nodiscard]] AxisPath shaped(const AxisPath& path, const dynamics::ShaperPulses& pulses);

// The motion given at nodes, the first at start_s, with b̈ linear between them. Each interval
// becomes `parts` parabolas whose ends are exact and whose acceleration is the mean.
[[nodiscard]] AxisPath through_nodes(const dynamics::AxisTrajectory& nodes, double start_s,
                                     double period_s, int parts);

// Gives b and ḃ at time t. Times must not decrease from call to call.
class PathCursor {
 public:
  explicit PathCursor(const AxisPath& path) : path_(&path) {}
  [[nodiscard]] dynamics::NozzleMotion at(double t);

 private:
  const AxisPath* path_;
  std::size_t index_ = 0;
};

// When the last parabola begins. If the path comes to rest, it does so then.
[[nodiscard]] double end_s(const AxisPath& path);

// The least and the largest of both axes.
[[nodiscard]] double start_s(const Axes<AxisPath>& paths);
[[nodiscard]] double end_s(const Axes<AxisPath>& paths);

struct PeakMotion {
  double velocity_mm_s = 0.0;
  double accel_mm_s2 = 0.0;
};
[[nodiscard]] PeakMotion peak(const AxisPath& path);

// The nozzle on a path, in closed form from one parabola's beginning to the next. Times must not
// decrease from call to call. Until start_s the nozzle rests at the path's beginning; start_s must
// not be later than the first parabola.
class NozzleWalk {
 public:
  NozzleWalk(const dynamics::FlexibleAxis& axis, const AxisPath& path, double start_s);
  [[nodiscard]] const dynamics::NozzleState& at(double t);

 private:
  void step(const dynamics::BaseSegment& base, double h);

  dynamics::FlexibleAxis axis_;
  const AxisPath* path_;
  std::size_t index_ = 0;
  double now_s_;
  dynamics::NozzleState nozzle_;
  double last_step_s_ = 0.0;
  // For steps of this length, which came twice in a row.
  double map_step_s_ = 0.0;
  dynamics::ExactMap map_;
};

// The nozzle on the paths of both axes.
class NozzleWalkXY {
 public:
  NozzleWalkXY(const Axes<dynamics::FlexibleAxis>& axes, const Axes<AxisPath>& paths,
               double start_s);
  [[nodiscard]] XY place_mm(double t);

 private:
  Axes<NozzleWalk> walks_;
};

// Sampling times: start_s + k · step_s for k = 0 … count − 1.
struct TimeGrid {
  double start_s = 0.0;
  double step_s = 1e-4;
  std::size_t count = 0;

  [[nodiscard]] double at(std::size_t k) const { return start_s + static_cast<double>(k) * step_s; }
};

// The nozzle at the times of the grid, by a NozzleWalk that begins at the first one.
[[nodiscard]] std::vector<dynamics::NozzleState> nozzle_on(const dynamics::FlexibleAxis& axis,
                                                           const AxisPath& path,
                                                           const TimeGrid& grid);

}  // namespace unflex::rivals
