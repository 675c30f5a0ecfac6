// The modes of an axis behind records of it.
//
// Base acceleration b̈ reaches the tool through
//   H(s) = Σ g_i (2 ζ_i ω_i s + ω_i²) / (s² + 2 ζ_i ω_i s + ω_i²),   Σ g_i = 1,
// and the density of the tool's acceleration at ν Hz is
//   P(ν) = C ν² |H(ν)|² + N₀ + N₁/ν².
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "unflex/core/error.hpp"
#include "unflex/identify/record.hpp"

namespace unflex::identify {

struct Estimate {
  double value = 0.0;
  double low = 0.0;  // lower end of the 95 % interval
  double high = 0.0;
};

enum class Method {
  sweep,     // a whole sweep
  spectrum,  // the spectrum of a sweep by Welch's method
  ringing,   // the decay after a move
  tower,     // measured by hand
  combined,  // several records
};

[[nodiscard]] std::string_view to_string(Method method);

struct ModeOfAxis {
  double freq_hz = 0.0;
  double damping_ratio = 0.0;
  double gain = 1.0;  // of either sign; those of an axis add up to 1
};

struct ModeEstimate {
  Estimate freq_hz;
  Estimate damping_ratio;
  Estimate gain = {1.0, 1.0, 1.0};
};

// A machine that the records allow.
struct Plant {
  std::vector<ModeOfAxis> modes;
  double share = 0.0;  // its probability
};

struct AxisModel {
  Method method = Method::sweep;
  // The main mode comes first. It swings the nozzle farthest for a given speed of the base to and
  // fro: its |g| / (4π ζ f) is the largest of those in the band of the sweep. The others follow by
  // this measure.
  std::vector<ModeEstimate> modes;
  // Covariance of (log f, log ζ, g) for each mode in turn: 3n rows of 3n numbers.
  std::vector<double> covariance;
  std::vector<Plant> plants;  // the modes as estimated first; shares add up to 1

  // The modes as estimated, without their intervals.
  [[nodiscard]] const std::vector<ModeOfAxis>& values() const { return plants.front().modes; }
};

// The measurement and the model for a drawing: energy over frequency in Hz, or acceleration over
// time in s. All are relative to the same scale.
struct Curve {
  bool is_spectrum = true;
  std::vector<double> x;
  std::vector<double> measured;
  std::vector<double> fitted;
  std::vector<std::vector<double>> modes;  // each mode alone; of a spectrum only
  std::vector<double> noise;               // of a spectrum only
};

struct RecordFit {
  AxisModel model;
  // The reason why no model of the record is trusted, and the remedy. Empty: `model` holds.
  // Otherwise `model` and `curve` show the closest fit, if there is one.
  std::string refusal;
  // The direction of the sensor along which the axis moved, a unit vector. Zero if nothing tells.
  std::array<double, 3> direction{};
  double unexplained = 0.0;  // share of the measurement that the model does not explain, 0 to 1
  Curve curve;
  // Bayesian information criterion of the best fit of a spectrum with 0, 1, 2 … modes, trusted or
  // not. With no mode, the tool moves as the base does.
  std::vector<double> bic;
  std::vector<std::string> warnings;

  [[nodiscard]] bool is_trusted() const { return refusal.empty(); }
};

// The sweep that excited the printer. Klipper: FREQ_START and FREQ_END of TEST_RESONANCES; the
// default is the band that the sweeps of all its versions share.
struct Sweep {
  double start_hz = 5.0;
  double end_hz = 133.0;
};

// Fits one to three modes to a spectrum or to the recording of a sweep, or one mode to ringing.
// However the sensor is mounted, the direction with the most motion counts. Errors are of kind
// input: a record that cannot be fitted at all, since it is too short or nothing moved.
[[nodiscard]] Result<RecordFit> fit(const DataSet& set, Axis axis, const Sweep& sweep);
[[nodiscard]] Result<RecordFit> fit_recording(const Recording& recording, Axis axis,
                                              const Sweep& sweep);
[[nodiscard]] Result<RecordFit> fit_spectrum(const Spectrum& spectrum, const Sweep& sweep);

// Fits the mode that still rings behind a stop of a compensated axis to a recording of the stop.
// `known`: the modes that the axis is compensated for. The mode found is at least 25 % away from
// them. A stop behind which nothing else rings is refused. A spectrum is an error of kind input.
[[nodiscard]] Result<RecordFit> fit_second(const DataSet& set, Axis axis,
                                           const std::vector<ModeOfAxis>& known);

// Whether the main modes of these models are within 5 % of each other.
[[nodiscard]] bool agree(const std::vector<AxisModel>& models);

// The plants besides the estimate, at most six. None if all of them swing like the estimate within
// 3 %, as in a good record. Plants share modes with each other and with the estimate where this
// changes the swing of each by less than a tenth.
[[nodiscard]] std::vector<Plant> other_plants(const AxisModel& model);

// The axis, X or Y, that moved more.
[[nodiscard]] Axis dominant_axis(const DataSet& set);

// Combines the models of several records of an axis, all of them trusted. The differences between
// the records are part of the intervals and the plants: the axis may be as any record tells.
[[nodiscard]] AxisModel combine(const std::vector<AxisModel>& models);

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
[[nodiscard]] Result<RecordFit> fit_tower(const Tower& tower);

}  // namespace unflex::identify
