// A run: a stretch of motion between two moments of rest that is compensated as a whole.
//
//   r(t)  reference: the planned moves, after the lead-in and before the tail
//   b(t)  base, at rest at both ends of the run
#pragma once

#include <cstddef>
#include <vector>

#include "unflex/compensate/axis_window.hpp"
#include "unflex/dynamics/base_trajectory.hpp"
#include "unflex/planner/planner.hpp"

namespace unflex::compensate {

struct AxisSetup {
  dynamics::FlexibleAxis axis;
  // Position limits may be widened per run to where the sliced path itself goes.
  BaseLimits limits;
};

struct Setup {
  AxisSetup x;
  AxisSetup y;
  double period_s = 1e-3;
  double lead_in_s = 0.0;     // rest of the reference before the first move
  double tail_s = 2e-3;       // rest of the reference after the last move, at least
  double window_s = 2.0;      // core of a window where a run needs several
  double overlap_s = 0.06;    // pre-roll and post-roll of such windows
  double travel_weight = 0.1; // w where nothing is extruded; 1 where something is
  double jerk_weight = 1.5;      // ρ / (h⁶ (ωh)⁴)
};

// Nodes of a run, from rest to rest.
[[nodiscard]] std::size_t node_count(const std::vector<planner::PlannedMove>& moves,
                                     const Setup& setup);

// One window of a run: nodes first … last are solved, core_first … core_last are used.
struct WindowSpan {
  std::size_t first = 0;
  std::size_t last = 0;
  std::size_t core_first = 0;
  std::size_t core_last = 0;
};

// The whole run if it is short enough, otherwise cores of equal length with overlap. Depends on
// nothing but the numbers given, so that the result is the same for any number of workers.
[[nodiscard]] std::vector<WindowSpan> cut(std::size_t nodes, const Setup& setup);

// Both axes of one window.
struct RunWindow {
  AxisWindow x;
  AxisWindow y;
};

// The problems of all windows. moves: the run's plan, from rest to rest, not empty. nozzle: where
// the nozzle is, and how fast, when the run begins (rest but for what earlier motion left behind).
[[nodiscard]] std::vector<RunWindow> windows(const std::vector<planner::PlannedMove>& moves,
                                             const std::vector<WindowSpan>& spans,
                                             const dynamics::NozzleXY& nozzle, const Setup& setup);

// The same for `count` windows from number `first` on.
[[nodiscard]] std::vector<RunWindow> windows(const std::vector<planner::PlannedMove>& moves,
                                             const std::vector<WindowSpan>& spans,
                                             std::size_t first, std::size_t count,
                                             const dynamics::NozzleXY& nozzle, const Setup& setup);

// Joins the solutions of the windows, in the order of `spans`, blending over the middle of each
// overlap.
[[nodiscard]] dynamics::AxisTrajectory join(
    const std::vector<WindowSpan>& spans,
    const std::vector<dynamics::AxisTrajectory>& solutions);

}  // namespace unflex::compensate
