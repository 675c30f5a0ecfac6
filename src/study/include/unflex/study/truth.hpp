// A machine as a record shows it, fitted without anything of `identify`: what unflex is judged on
// must not share its errors.
#pragma once

#include <optional>
#include <vector>

#include "unflex/dynamics/flexible_axis.hpp"

namespace unflex::study {

// One to four modes whose density
//   P(ν) = ν² |Σ a_i h_i(ν)|² + N₀,   h_i = (1 + 2iζr) / (1 − r² + 2iζr),   r = ν/f_i,
// is nearest to `density`, the density of the tool's acceleration at k · step_hz. Densities are
// compared by log P/ν² from 15 to 128 Hz, with a soft L1 loss. The number of modes is the one with
// the lowest Bayesian information criterion. Among fits of about equal size those count whose zeros
// lie in the left half plane. The modes' gains a_i/Σa add up to 1. nullopt if there is no motion.
[[nodiscard]] std::optional<std::vector<dynamics::Mode>> fitted_truth(
    double step_hz, const std::vector<double>& density);

}  // namespace unflex::study
