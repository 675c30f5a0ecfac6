// Fits one to three modes to a density over frequency.
#pragma once

#include "band.hpp"
#include "modes_choice.hpp"

namespace unflex::identify {

struct ModesFit {
  RecordFit record;
  Eigen::VectorXd theta;    // as ModesModel's, main mode first
  bool has_rivals = false;  // another main mode fits as well
};

// Errors are those of band_of().
[[nodiscard]] Result<ModesFit> fit_modes(const Spectrum& spectrum, const Sweep& sweep);

}  // namespace unflex::identify
