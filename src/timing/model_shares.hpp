// The shares that the models of the axes have in the base.
//
// The engine makes a sum of squares small, in which each model has its share. But the largest error
// counts here. So a model whose nozzle strays further than the others gets more from round to
// round.
#pragma once

#include <span>
#include <vector>

#include "nozzle_measure.hpp"
#include "unflex/compensate/axis_window.hpp"
#include "unflex/compensate/run.hpp"
#include "unflex/planner/planner.hpp"

namespace unflex::timing {

class ModelShares {
 public:
  // The plants of the setup have the shares to begin with.
  explicit ModelShares(const compensate::Setup& setup);

  // Sets the plants of the setup for the next round. measured: what the last one has come to on the
  // pieces. A plant of hardly any share is left out, since each costs time, but may come back.
  void follow(const NozzleMeasure& measured, std::span<const planner::PlannedMove> pieces,
              const Allowances& allowances, compensate::Setup& setup);

 private:
  // One axis: its plants as given, and the factors of the shares of all models, numbered as
  // models_of() does.
  struct OfAxis {
    std::vector<compensate::Plant> given;
    std::vector<double> factors;
  };

  static void adapt(const std::vector<double>& errors, std::vector<double>& factors);
  static std::vector<compensate::Plant> plants_of(const OfAxis& axis);

  Axes<OfAxis> axes_;
};

}  // namespace unflex::timing
