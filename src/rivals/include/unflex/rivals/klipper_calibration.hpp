// Which input shaper Klipper's SHAPER_CALIBRATE sets up for a record (klippy/extras/
// shaper_calibrate.py, commit 84104bb).
//
//   P(ν)   power spectral density of the record over ν, as SHAPER_CALIBRATE looks at it
//   v      share of P that a shaper leaves, at the worst of three damping ratios
//   s      smoothing: how far the shaper cuts a corner at 5000 mm/s², mm
//
// A shaper gets the frequency with the lowest score s (v^1.5 + v/5 + 1/100) among those that leave
// little more than the least v. Recommended is the shaper whose score is lower by more than a
// little.
#pragma once

#include <optional>
#include <vector>

#include "unflex/dynamics/shapers.hpp"

namespace unflex::rivals {

struct FittedShaper {
  dynamics::ShaperKind kind = dynamics::ShaperKind::zv;
  double freq_hz = 0.0;
  double vibration = 0.0;  // v
  double smoothing_mm = 0.0;
  double score = 0.0;

  // The shaper's pulses, for the damping ratio that Klipper takes if it is told none.
  [[nodiscard]] dynamics::ShaperPulses pulses() const;
};

// The share of a vibration's amplitude that the pulses leave, at each frequency, for the damping
// ratio that Klipper takes if it is told none.
[[nodiscard]] std::vector<double> amplitude_left(const dynamics::ShaperPulses& pulses,
                                                 const std::vector<double>& freq_hz);

struct KlipperCalibration {
  std::vector<FittedShaper> shapers;  // ZV, MZV, EI, 2HUMP_EI, 3HUMP_EI, each at its own frequency
  FittedShaper recommended;

  [[nodiscard]] const FittedShaper& of(dynamics::ShaperKind kind) const;
};

// The corner speed that the calibration assumes.
inline constexpr double kCalibrationCorner_mm_s = 5.0;

// The largest acceleration that the calibration advises with a shaper: there the shaper cuts a
// corner by 0.12 mm (find_shaper_max_accel). 0 if it cuts that much at any acceleration.
[[nodiscard]] double advised_accel_mm_s2(const dynamics::ShaperPulses& pulses);

// `density`: sum over the sensor's columns at k · step_hz, acceleration² per Hz. nullopt if there
// is no motion in it.
[[nodiscard]] std::optional<KlipperCalibration> klipper_calibration(
    double step_hz, const std::vector<double>& density);

}  // namespace unflex::rivals
