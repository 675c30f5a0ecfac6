// Frequency and damping of the mode behind a record.
//
// The nozzle of docs/theory.md answers the base's acceleration b̈ with its own,
//   P(ν) = H(ν) B(ν),   H(ν) = (1 + 2iζr) / (1 − r² + 2iζr),   r = ν/f.
#pragma once

#include <string>
#include <vector>

#include "unflex/core/error.hpp"
#include "unflex/identify/record.hpp"

namespace unflex::identify {

struct Estimate {
  double value = 0.0;
  double low = 0.0;  // lower end of the 95 % interval
  double high = 0.0;
};

// What was measured and what the fitted mode gives, for a drawing: energy over frequency in Hz, or
// acceleration over time in s.
struct Curve {
  bool is_spectrum = true;
  std::vector<double> x;
  std::vector<double> measured;  // relative
  std::vector<double> fitted;
};

enum class Method {
  sweep,     // the spectrum of a whole sweep
  spectrum,  // a spectrum by Welch's method
  ringing,   // the decay after a move
  tower,     // measured by hand
  combined,  // several records
};

[[nodiscard]] std::string_view to_string(Method method);

struct Mode {
  Method method = Method::sweep;
  Estimate freq_hz;
  Estimate damping_ratio;
  double unexplained = 0.0;  // share of the measurement that the mode does not explain, 0 to 1
  Curve curve;
  std::vector<std::string> warnings;
};

// The sweep that excited the printer. Klipper: FREQ_START and FREQ_END of TEST_RESONANCES; the
// default is the band that the sweeps of all its versions share.
struct Sweep {
  double start_hz = 5.0;
  double end_hz = 133.0;
};

// Fits a mode to the samples of one axis: to a sweep if they hold one, otherwise to ringing.
[[nodiscard]] Result<Mode> fit_recording(const Recording& recording, Axis axis, const Sweep& sweep);
[[nodiscard]] Result<Mode> fit_spectrum(const Spectrum& spectrum, Axis axis, const Sweep& sweep);
[[nodiscard]] Result<Mode> fit(const DataSet& set, Axis axis, const Sweep& sweep);

// The one of X and Y that moved more.
[[nodiscard]] Axis dominant_axis(const DataSet& set);

// One mode from several records of it. If the records differ by more than their intervals, the
// interval of the mode grows.
[[nodiscard]] Mode combine(const std::vector<Mode>& modes);

// A ringing tower: waves `spacing_mm` apart on a wall printed at `speed_mm_s`, and how many times
// lower each wave is than the one before. A spread is half of the range in which the value may lie.
struct Tower {
  double spacing_mm = 0.0;
  double spacing_spread_mm = 0.0;
  double speed_mm_s = 0.0;
  double decay = 0.0;  // height of a wave over the height of the next, above 1; 0: not measured
  double decay_spread = 0.0;
};

// Without decay the damping ratio is Klipper's default 0.1, from 0.03 to 0.2.
[[nodiscard]] Result<Mode> fit_tower(const Tower& tower);

}  // namespace unflex::identify
