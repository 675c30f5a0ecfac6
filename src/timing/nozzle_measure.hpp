// Measures the nozzle's motion in a run whose base is given.
//
//   e   contour error, the distance from the nozzle to the path around the reference
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "unflex/compensate/run.hpp"
#include "unflex/core/axes.hpp"
#include "unflex/dynamics/base_trajectory.hpp"
#include "unflex/dynamics/flexible_axis.hpp"
#include "unflex/planner/planner.hpp"
#include "unflex/timing/timing.hpp"

namespace unflex::timing {

// How many tolerances the nozzle may stray at the edges of the band of frequencies. The nozzle of a
// shaper strays 1.6 times as far where the frequency is 5 % off.
inline constexpr double kTimesAtEdge = 2.0;

// Models of less share only keep the base from moving more than it must.
inline constexpr double kLeastShare = 0.05;

[[nodiscard]] inline bool is_model(const compensate::Plant& plant) {
  return plant.share >= kLeastShare;
}

// Models of both axes.
struct AxesModel : Axes<dynamics::FlexibleAxis> {
  double times_tolerance = 1.0;  // how many tolerances its nozzle may stray
  dynamics::FieldXY field = {};
};

// All models for which a tolerance shall hold: the axes as given, and the axes at the edges of
// their range.
[[nodiscard]] std::vector<AxesModel> models_of(const compensate::Setup& setup);

// How far the nozzle of an axis swings while the base rests there.
[[nodiscard]] double swing_mm(const dynamics::FlexibleAxis& axis,
                              const dynamics::NozzleState& nozzle, double base_mm);

// How many times its tolerance each model's nozzle may stray on each piece. Empty: once.
using Allowances = std::vector<std::vector<double>>;

// Largest error / tolerance, and largest speed / F, that still count as kept.
inline constexpr double kKept = 1.05;
inline constexpr double kKeptFeed = 1.0195;

struct NozzleMeasure {
  // For each model and piece, the largest e relative to the tolerance, whatever is allowed.
  std::vector<std::vector<double>> of_pieces;
  // The largest values of all models around each node.
  std::vector<double> error;  // e relative to the tolerance and its allowance
  // The nozzle's speed relative to F, and in travel the base's as well; at the edges of a band it
  // may be more.
  std::vector<double> speed;
  // The error of the line's width around each node with the first model's nozzle, relative to its
  // tolerance.
  std::vector<double> width;
  // For each model, the nozzle's swing in the end relative to its allowance. The first model's
  // allowance is half the tolerance, since the next run begins with this swing. The other models'
  // allowance is the whole tolerance.
  std::vector<double> left;
};

// plan: the plan that the base was found for. Its pieces have these bounds. starts_s: the start of
// each piece, and the end of the last one. nozzle: its state where the run begins; unset for a part
// that begins in motion. extruder: unset if the width does not count.
[[nodiscard]] NozzleMeasure measure(std::span<const planner::PlannedMove> plan,
                                    std::span<const MoveBounds> bounds,
                                    std::span<const double> starts_s,
                                    const dynamics::BaseTrajectory& base,
                                    const std::vector<AxesModel>& models,
                                    const Allowances& allowances, const dynamics::NozzleXY* nozzle,
                                    const std::optional<Extruder>& extruder);

}  // namespace unflex::timing
