// A run: a stretch of motion between two moments of rest that is compensated as a whole, or, where
// it is long, part by part.
//
//   r(t)  reference: the planned moves, after the lead-in and before the tail
//   b(t)  base, at rest at both ends of the run
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "unflex/compensate/axis_window.hpp"
#include "unflex/core/axes.hpp"
#include "unflex/core/error.hpp"
#include "unflex/dynamics/base_trajectory.hpp"
#include "unflex/dynamics/frequency_field.hpp"
#include "unflex/dynamics/mode_frame.hpp"
#include "unflex/dynamics/shapers.hpp"
#include "unflex/planner/planner.hpp"

namespace unflex::compensate {

struct AxisSetup {
  dynamics::FlexibleAxis axis;
  std::vector<Plant> plants;  // as in AxisWindow
  // How the frequencies of all models change over the bed.
  dynamics::FrequencyField field;
  // Position limits may be widened per run to where the sliced path itself goes.
  BaseLimits limits;
  dynamics::ShaperPulses pulses;  // of the second stage (second_stage.hpp); empty: there is none
};

// The motors of modes, and their limits: |Σ_j g_ij β̈_j| ≤ A. The limits of each AxisSetup are those
// that it has while the others rest.
struct ModeMotors {
  dynamics::ModeFrame::Matrix by_modes{};  // g, motors by modes
  double max_velocity_mm_s = std::numeric_limits<double>::infinity();
  double max_accel_mm_s2 = std::numeric_limits<double>::infinity();
  double max_z_accel_mm_s2 = std::numeric_limits<double>::infinity();  // the firmware's, of Z
};

// Models that X and Y may have at the same time, by their numbers in AxisWindow.
struct ModelPair : Axes<std::size_t> {
  double share = 1.0;
};

// Settings under which the error across the path counts, and the error along the path hardly counts
// (contour.hpp).
struct Contour {
  double along_weight = 0.01;         // ε
  double corner_weight = 5.0;         // λ
  double tracking_jerk_weight = 1.5;  // Setup::jerk_weight as it is without a contour
  double reach_s = 0.031;  // how far from its time the nozzle's nearest place is looked for
  std::vector<ModelPair> pairs = {{}};  // shares add up to 1
};

// Pairs of the axes' models, so shared out that each model has its own share. Sorted by frequency,
// 70 % of the pairs have both axes off the same way, as a heavier load makes them, and 30 % have
// them off opposite ways.
[[nodiscard]] std::vector<ModelPair> pairs_of(const Axes<AxisSetup>& setup);

struct Setup : Axes<AxisSetup> {
  // Whether the limits of velocity and acceleration hold for motors that move both X and Y: |ẋ| +
  // |ẏ| ≤ V, |ẍ| + |ÿ| ≤ A. They are equal for X and Y then.
  bool shares_motors = false;
  double period_s = 1e-3;
  double lead_in_s = 0.0;          // rest of the reference before the first move
  double tail_s = 2e-3;            // rest of the reference after the last move, at least
  double window_s = 2.0;           // core of a window where a run needs several
  double overlap_s = 0.06;         // pre-roll and post-roll of such windows
  double travel_weight = 0.1;      // w where nothing is extruded; 1 where something is
  double end_weight = 0.0;         // least w around the end of a run
  double jerk_weight = 1.5;        // ρ / (h⁶ (ωh)⁴)
  std::optional<Contour> contour;  // unset: the nozzle shall be where r is at the time
  // The machine's modes, where they do not lie along the axes (dynamics/mode_frame.hpp). X and Y
  // are then modes 0 and 1, `third` is mode 2 unless that is rigid, and there is no contour.
  std::shared_ptr<const dynamics::ModeFrame> frame;
  std::optional<AxisSetup> third;
  std::optional<ModeMotors> motors;  // set with `third`: the limits of the motors of all modes

  // Whether the base is to suit more models than the axes as given.
  [[nodiscard]] bool is_robust() const {
    return any_axis([](const AxisSetup& axis) { return !axis.plants.empty(); }, *this);
  }
};

[[nodiscard]] inline dynamics::FieldXY field_of(const Axes<AxisSetup>& setup) {
  return map_axes([](const AxisSetup& axis) { return axis.field; }, setup);
}

// The motion that the nozzle shall follow: the plan of a run, or of a part of a run.
struct Course {
  using Moves = std::span<const planner::PlannedMove>;

  Course(const std::vector<planner::PlannedMove>& run) : moves(run) {}
  Course(Moves ahead, Moves part, Moves behind) : before(ahead), moves(part), after(behind) {}

  // The moves around a part: at least 2 Setup::overlap_s of them, or all there are. Empty: rest.
  Moves before;
  Moves moves;  // not empty
  Moves after;
};

// The nodes of a course.
struct NodeGrid {
  double period_s = 0.0;  // chosen so that a part ends at a node
  std::size_t count = 0;
  // The moves of the course itself lie between these nodes. The nodes outside are solved for the
  // sake of its ends.
  std::size_t first = 0;
  std::size_t last = 0;
};

[[nodiscard]] NodeGrid node_grid(const Course& course, const Setup& setup);

// When the course's own moves begin, from the first node on.
[[nodiscard]] double origin_s(const Course& course, const NodeGrid& grid, const Setup& setup);

// One window of a run: nodes first … last are solved, core_first … core_last are used.
struct WindowSpan {
  std::size_t first = 0;
  std::size_t last = 0;
  std::size_t core_first = 0;
  std::size_t core_last = 0;
  // The reference has long been in even motion, and still is. In any solution the base would follow
  // it, so there is nothing to solve.
  bool cruise = false;
};

// One window over all nodes if they are few enough, otherwise windows with cores of equal length
// and with overlap. Depends on nothing but the numbers given, so that the result is the same for
// any number of workers.
[[nodiscard]] std::vector<WindowSpan> cut(std::size_t nodes, const Setup& setup);

// Windows where the plan accelerates, and cruises between them. The first and the last span are
// windows.
[[nodiscard]] std::vector<WindowSpan> mesh(const Course& course, const NodeGrid& grid,
                                           const Setup& setup);

// The number of spans that are not cruises.
[[nodiscard]] std::size_t windows_to_solve(const std::vector<WindowSpan>& spans);

// A vertex of the path.
struct PathVertex {
  XY place_mm;
  double sample = 0.0;    // when r is there, in half node periods from the window's first node on
  bool is_sharp = false;  // a sharp corner, or an end of a run
};

// Both axes of one window.
struct RunWindow : Axes<AxisWindow> {
  bool shares_motors = false;  // as in Setup
  // Only with a contour: the path of the window and as far around it as its reach.
  std::optional<Contour> contour = {};
  std::vector<PathVertex> path = {};
  std::shared_ptr<const dynamics::ModeFrame> frame = {};  // as in Setup
  std::optional<AxisWindow> third = {};                   // mode 2
  std::optional<ModeMotors> motors = {};
};

// The problems of all windows, on the nodes of node_grid(). nozzle: its position and velocity when
// the run begins (at rest, apart from what earlier motion left behind).
[[nodiscard]] std::vector<RunWindow> windows(const Course& course,
                                             const std::vector<WindowSpan>& spans,
                                             const dynamics::NozzleXY& nozzle, const Setup& setup);

// The problems of `count` windows from number `first` on.
[[nodiscard]] std::vector<RunWindow> windows(const Course& course,
                                             const std::vector<WindowSpan>& spans,
                                             std::size_t first, std::size_t count,
                                             const dynamics::NozzleXY& nozzle, const Setup& setup);

// The solution for one axis of a cruise: the reference.
[[nodiscard]] AxisSolution along(const AxisWindow& window);

struct AxisSolutions : Axes<Result<AxisSolution>> {
  std::optional<Result<AxisSolution>> third = {};  // of RunWindow::third
};

// Solves X and Y of a window by the engine. In a cruise the solution is the reference. With a
// contour the window gets aims and weights, and if the axes share motors it gets limits at the
// nodes. Under these each axis by itself has this solution.
[[nodiscard]] AxisSolutions solve(const Engine& engine, const WindowSpan& span, RunWindow& window);

// The base over all nodes, where `windows` are those of `spans`: solves each window here, and joins
// the solutions. An error: the first axis that could not be solved. each: sees every solution.
[[nodiscard]] Result<dynamics::BaseTrajectory> solve_all(
    const Engine& engine, const std::vector<WindowSpan>& spans, std::vector<RunWindow>& windows,
    const std::function<void(const AxisSolution&)>& each = nullptr);

// The base as it moves in the axes, where it was found in these modes. third: that of mode 2, if
// that is not rigid. Where Z would accelerate by more than max_z_accel_mm_s2, it goes less far.
[[nodiscard]] dynamics::BaseTrajectory in_axes(const dynamics::ModeFrame& frame,
                                               const dynamics::BaseTrajectory& in_modes,
                                               const std::optional<dynamics::AxisTrajectory>& third,
                                               double max_z_accel_mm_s2);

// Makes each axis of a window a problem of its own, as solve() does, for an engine that solves it
// elsewhere. divider: the engine that solves here what the division into such problems needs.
void prepare(const Engine& divider, const WindowSpan& span, RunWindow& window);

// Joins the solutions of the windows, in the order of `spans`, blending over the middle of each
// overlap.
[[nodiscard]] dynamics::AxisTrajectory join(const std::vector<WindowSpan>& spans,
                                            const std::vector<dynamics::AxisTrajectory>& solutions);

}  // namespace unflex::compensate
