// The window of Klipper's spectra by Welch's method: Kaiser's with β = 6. Its spectrum x bins from
// the centre is (Kaiser and Schafer, On the Use of the I0-sinh Window for Spectrum Analysis, 1980)
//   sinh √(β² − π²x²) / √(β² − π²x²).
#pragma once

#include <Eigen/Core>

namespace unflex::identify {

inline constexpr double kBetaOfWindow = 6.0;
inline constexpr int kPartsOfBin = 8;     // places per bin
inline constexpr int kReachOfWindow = 4;  // bins to either side

// The spectrum at all places from −kReachOfWindow to kReachOfWindow bins, up to a factor.
[[nodiscard]] Eigen::VectorXd kaiser_amplitude();

}  // namespace unflex::identify
