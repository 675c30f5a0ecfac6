// Chooses the timing of a run anew, along the path as it was sliced. The motion becomes as fast as
// a tolerance of the nozzle allows.
//
//   F   the slicer's feed, which stays        e   contour error of the nozzle
//
// Method: local scaling. The run is planned with limits of its own on every piece of the path, and
// compensate::solve() finds the base for that plan as for any other. Where the nozzle then strays
// more than the tolerance or runs ahead of F, the plan becomes slower; where there is room, it
// becomes faster; and so on.
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "unflex/compensate/axis_window.hpp"
#include "unflex/compensate/run.hpp"
#include "unflex/dynamics/base_trajectory.hpp"
#include "unflex/dynamics/flexible_axis.hpp"
#include "unflex/dynamics/hotend_pressure.hpp"
#include "unflex/planner/planner.hpp"

namespace unflex::timing {

// Bounds of a move, along its path.
struct MoveBounds {
  double speed_mm_s = std::numeric_limits<double>::infinity();
  double accel_mm_s2 = std::numeric_limits<double>::infinity();
  // Largest speeds at the move's beginning and end.
  double start_speed_mm_s = std::numeric_limits<double>::infinity();
  double end_speed_mm_s = std::numeric_limits<double>::infinity();
  // Largest speed of the nozzle, if that is lower than F; in travel that of the base, too.
  double nozzle_speed_mm_s = std::numeric_limits<double>::infinity();
  // Largest e for each model that the axes may have, where filament is laid, and the largest swing
  // at the end of a run.
  double tolerance_mm = std::numeric_limits<double>::infinity();
};

// Largest e of travel: it should not leave the way that the slicer has found between walls.
inline constexpr double kTravelTolerance_mm = 0.2;

// The extruder that feeds the nozzle, and how evenly it shall lay.
struct Extruder {
  dynamics::HotendPressure hotend;
  double max_accel_mm_s2 = 0.0;  // of filament
  double width_tolerance = 0.0;  // a share of the width
};

// The bounds that the firmware's limits of axes set to a move. Limits of acceleration in X and Y
// and of corners are left out. limits: the printer's limits, not the print's.
[[nodiscard]] MoveBounds bounds_by_axes(const planner::PlannedMove& move,
                                        const planner::Limits& limits,
                                        const planner::FirmwareConfig& config);

// AxisSetup::plants of both axes.
using Plants = Axes<std::vector<compensate::Plant>>;

// A run's path in a new timing.
struct Timed {
  std::vector<planner::PlannedMove> moves;  // each move in one piece or several
  std::vector<std::size_t> pieces;          // how many, for each move of the path
  // The base for this timing, on compensate::node_grid(). Unset: it is still to be solved for.
  std::optional<dynamics::BaseTrajectory> base = {};
  // Models that the base shall suit besides the axes as given. Unset: the setup's plants.
  std::optional<Plants> plants = {};
};

// The moves of the course in less time. Each move keeps its own entry of `bounds`. A part of a
// longer run keeps its timing where it meets its neighbours. If the nozzle of one of several models
// strays further than its tolerance in the timing as sliced, it may stray as far in the new timing.
// If the extruder cannot lay evenly in the timing as sliced, the new timing may be slower. nullopt:
// no such timing was found.
[[nodiscard]] std::optional<Timed> faster(const compensate::Course& course,
                                          const compensate::Setup& setup,
                                          const dynamics::NozzleXY& nozzle,
                                          std::span<const MoveBounds> bounds,
                                          const compensate::Engine& engine,
                                          const std::optional<Extruder>& extruder = {});

// The moves of the course in their timing as sliced, slower where the nozzle would run ahead of F,
// or the base in travel. nullopt: neither does, or no such timing was found.
[[nodiscard]] std::optional<Timed> within_feed(const compensate::Course& course,
                                               const compensate::Setup& setup,
                                               const dynamics::NozzleXY& nozzle,
                                               std::span<const MoveBounds> bounds,
                                               const compensate::Engine& engine);

// As faster(), by a program in which path and time are found together; the base comes with it. It
// takes whole runs only, and axes with one mode, whose frequencies may be in a band. The error
// tells why there is no such timing.
[[nodiscard]] tl::expected<Timed, std::string> optimal(
    const compensate::Course& course, const compensate::Setup& setup,
    const dynamics::NozzleXY& nozzle, std::span<const MoveBounds> bounds,
    const std::optional<Extruder>& extruder = {});

}  // namespace unflex::timing
