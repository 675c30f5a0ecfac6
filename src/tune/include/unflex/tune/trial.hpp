// Calibration by printing: each band of a tower is compensated for another frequency or damping
// ratio, and whoever looks at the walls tells between which bands no waves can be seen.
//
//   δ        error of the frequency, as a share
//   Δζ       error of the damping ratio
//   k        height of the waves for an error of 1 % (or of 0.01), from trough to crest, µm
//
// A base made for other values than the axis has leaves waves of the height 100 k √(δ² + Δζ²),
// since its transfer function is 2(δ + iΔζ) instead of 0 at the axis' pole. So the zone without
// waves lies around the true value, even if the other value is somewhat off. The rounds therefore
// alternate: frequency, damping ratio, frequency, ….
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "unflex/core/error.hpp"

namespace unflex::tune {

// The knowledge of an axis, and how far it may be off either way.
struct Knowledge {
  double freq_hz = 0.0;     // 0: nothing is known
  double freq_error = 0.0;  // share
  double damping_ratio = 0.08;
  double damping_error = 0.07;
  std::size_t rounds = 0;  // prints read so far

  [[nodiscard]] bool has_freq() const { return freq_hz > 0.0; }
};

enum class Parameter { freq_hz, damping_ratio };

// How the wall of a tower makes the axis swing: a wave across it, from one side of the wall to the
// straight line and back, as often as `count` says.
struct Waves {
  double freq_hz = 0.0;
  double accel_mm_s2 = 0.0;  // the largest acceleration across the wall
  int count = 1;

  // From the straight line to the crest: 2a/ω².
  [[nodiscard]] double height_mm() const;
};

// The values that one tower tries for one axis. Band n of 1 … bands has the value first · stepⁿ⁻¹
// for a frequency and first + (n − 1) · step for a damping ratio.
struct Trial {
  Parameter parameter = Parameter::freq_hz;
  std::size_t bands = 0;
  double first = 0.0;
  double step = 0.0;
  Knowledge known = {};  // before this tower
  Waves waves = {};

  [[nodiscard]] double value(std::size_t band) const;
  // The values that a band is compensated for.
  [[nodiscard]] double freq_hz(std::size_t band) const;
  [[nodiscard]] double damping_ratio(std::size_t band) const;
};

// The bands in which no waves are seen, from 1 on.
struct Zone {
  std::size_t first = 0;
  std::size_t last = 0;
};

// The next trial for an axis whose print accelerates by accel_mm_s2.
[[nodiscard]] Trial next_trial(const Knowledge& known, double accel_mm_s2);

// The acceleration of the print at which the trial's walls can be read. Below it, bands that are
// far off show no waves either. 0 if the trial's own acceleration is enough.
[[nodiscard]] double needed_accel_mm_s2(const Trial& trial, double accel_mm_s2);

// The knowledge that follows from the zone. If the zone reaches an end of the bands, the true value
// may lie beyond, and the known error is widened for this. Errors are of kind usage: the trial has
// no such bands.
[[nodiscard]] Result<Knowledge> read(const Trial& trial, const Zone& zone);

// Writes a trial as a line of comment in the tower's G-code, without its end, and reads it back.
// from_comment(): an error of kind input if the line begins like a trial but is none; `place` is
// the line's.
inline constexpr std::string_view kTrialMark = "; unflex tune: axis=";
[[nodiscard]] std::string to_comment(char axis, const Trial& trial);
struct AxisTrial {
  char axis = 'x';
  Trial trial;
};
[[nodiscard]] Result<AxisTrial> from_comment(std::string_view line, const SourcePlace& place);

}  // namespace unflex::tune
