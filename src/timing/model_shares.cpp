#include "model_shares.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <utility>

#include "tunings.hpp"
#include "unflex/core/math.hpp"

namespace unflex::timing {
namespace {

using Tuned = ScalingTunings;

// Keeps the mean error above 0, which is divided by.
constexpr double kNothing = 1e-6;

// Each model's mean error over the pieces. A piece counts by the part of its direction that goes
// along this axis, where errors of the other axis lead off the path.
std::vector<double> errors_along(gcode::Axis along, const NozzleMeasure& measured,
                                 std::span<const planner::PlannedMove> pieces,
                                 const Allowances& allowances) {
  std::vector<double> errors;
  for (std::size_t m = 0; m < measured.of_pieces.size(); ++m) {
    double sum = 0.0;
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      if (pieces[i].segment.extruding()) {
        const double allowed = allowances.empty() ? 1.0 : allowances[m][i];
        sum += math::pow(std::abs(pieces[i].direction[along]) * measured.of_pieces[m][i] / allowed,
                         Tuned::kPower);
      }
    }
    errors.push_back(math::pow(sum, 1.0 / Tuned::kPower) + kNothing);
  }
  return errors;
}

}  // namespace

ModelShares::ModelShares(const compensate::Setup& setup)
    : axes_(map_axes(
          [](const compensate::AxisSetup& axis) {
            return OfAxis{axis.plants, {}};
          },
          setup)) {}

void ModelShares::follow(const NozzleMeasure& measured,
                         std::span<const planner::PlannedMove> pieces, const Allowances& allowances,
                         compensate::Setup& setup) {
  if (measured.of_pieces.size() < 2) {
    return;
  }
  constexpr Axes<gcode::Axis> kOther{gcode::Y, gcode::X};
  for_each_axis(
      [&](OfAxis& own, compensate::AxisSetup& axis, gcode::Axis other) {
        adapt(errors_along(other, measured, pieces, allowances), own.factors);
        axis.plants = plants_of(own);
      },
      axes_, setup, kOther);
}

void ModelShares::adapt(const std::vector<double>& errors, std::vector<double>& factors) {
  const double mean =
      std::accumulate(errors.begin(), errors.end(), 0.0) / static_cast<double>(errors.size());
  factors.resize(errors.size(), 1.0);
  for (std::size_t m = 0; m < errors.size(); ++m) {
    factors[m] = std::clamp(factors[m] * math::pow(errors[m] / mean, Tuned::kResponse),
                            1.0 / Tuned::kMostShareFactor, Tuned::kMostShareFactor);
  }
}

std::vector<compensate::Plant> ModelShares::plants_of(const OfAxis& axis) {
  double own = 1.0;  // the share of the axis as given
  double of_plants = 0.0;
  std::size_t m = 1;
  std::vector<compensate::Plant> plants;
  for (compensate::Plant plant : axis.given) {
    own -= plant.share;
    plant.share *= is_model(plant) ? axis.factors[m++] : 1.0;
    of_plants += plant.share;
    plants.push_back(std::move(plant));
  }
  own *= axis.factors.front();
  std::erase_if(plants, [&](const compensate::Plant& plant) {
    return plant.share < Tuned::kHardlyAny * (own + of_plants);
  });
  double sum = own;
  for (const compensate::Plant& plant : plants) {
    sum += plant.share;
  }
  for (compensate::Plant& plant : plants) {
    plant.share /= sum;
  }
  return plants;
}

}  // namespace unflex::timing
