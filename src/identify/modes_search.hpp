// Finds the fits of a given number of modes: all minima that a search from many places meets.
#pragma once

#include <vector>

#include "modes_model.hpp"

namespace unflex::identify {

inline constexpr double kLeastDamping = 0.01;
inline constexpr double kMostDamping = 0.4;
inline constexpr double kLossScale = 0.3;  // of the logarithm of the density

struct Solution {
  RobustFit fit;
  double bic = 0.0;
  bool is_minimum_phase = true;
};

// The knowledge of θ before the fit. If noise does not rise, N₁ is held.
[[nodiscard]] Prior prior_of(const Eigen::VectorXd& theta, const Sweep& sweep);

// Without modes: the tool moves as the base does.
[[nodiscard]] Solution rigid(const ModesModel& model, const Eigen::ArrayXd& logarithms);

// Minima with 1 to `most` modes, for each number in turn, with noise that rises and without.
[[nodiscard]] std::vector<std::vector<Solution>> search(const Band& band, const ModesModel& model,
                                                        const Sweep& sweep, Eigen::Index most);

}  // namespace unflex::identify
