// Welch's spectrum of samples, as Klipper computes it.
#pragma once

#include <vector>

#include "unflex/identify/record.hpp"

namespace unflex::identify {

// The density of the samples as the first column; the other two are zero. Windows are Kaiser's with
// β = 6, half overlapping, of half a second or more, without their mean (shaper_calibrate.py).
[[nodiscard]] Spectrum welch_spectrum(const std::vector<double>& samples, double rate_hz);

// The spectrum without SHAPER_CALIBRATE's division by the frequency.
[[nodiscard]] Spectrum as_acceleration(Spectrum spectrum);

}  // namespace unflex::identify
