// The linear map of a machine, found from places that were measured.
//
//   q_k = J p_k + c + r_k     Σ_k |r_k|² least, for each row by itself
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "unflex/core/error.hpp"
#include "unflex/kinematics/matrix.hpp"

namespace unflex::kinematics {

// Where the joints were, and where the tool was, mm.
struct Pair {
  Joints q_mm{};
  Point p_mm{};
};

struct Fit {
  Matrix rows{};                     // J
  Joints offset_mm{};                // c
  std::vector<Joints> residuals_mm;  // r, as many as pairs
  Joints rms_mm{};                   // of each row's residuals, over all pairs
  Joints largest_mm{};               // of their magnitudes
  std::size_t worst_row = 0;         // the row with the largest RMS
};

// J has three numbers in each row, and c one: four pairs tell them, and a fifth shows errors.
inline constexpr std::size_t kFewestPairs = 4;

// Errors are of kind input and have no place: too few pairs, tools that lie in a plane or nearly
// so, and rows that no machine can have (Motors::fault()).
[[nodiscard]] Result<Fit> fit(std::span<const Pair> pairs);

}  // namespace unflex::kinematics
