// One to three modes with gains behind a spectrum.
//
// Base acceleration b̈ reaches the tool through
//   H(s) = Σ g_i (2 ζ_i ω_i s + ω_i²) / (s² + 2 ζ_i ω_i s + ω_i²),   Σ g_i = 1,
// and the density of the tool's acceleration at ν Hz is, with Welch's window smearing its first
// term,
//   P(ν) = C ν² |H(ν)|² + N₀ + N₁/ν².
#pragma once

#include <array>
#include <string>
#include <vector>

#include "unflex/core/error.hpp"
#include "unflex/identify/mode.hpp"
#include "unflex/identify/record.hpp"

namespace unflex::identify {

struct ModeOfAxis {
  double freq_hz = 0.0;
  double damping_ratio = 0.0;
  double gain = 0.0;  // of either sign; those of an axis add up to 1
};

// A machine that the record allows.
struct Plant {
  std::vector<ModeOfAxis> modes;  // in the order of the fit's
  double share = 0.0;             // its probability
};

// Which density of a spectrum stands for the axis: the column with three fifths of the energy in
// the band, as a sensor may be mounted turned, or else the sum of all three.
struct AxisDensity {
  std::vector<double> density;  // as Spectrum's
  int column = -1;              // 0, 1, 2: X, Y, Z; -1: the sum
  double share = 0.0;           // of the column with the most energy
};

struct ModesFit {
  // The main mode comes first. It swings the nozzle farthest for a given speed of the base to and
  // fro: its |g| / (4π ζ f) is the largest of those in the band of the sweep. The others follow by
  // this measure.
  std::vector<ModeOfAxis> modes;
  struct Intervals {
    Estimate freq_hz;
    Estimate damping_ratio;
    Estimate gain;
  };
  std::vector<Intervals> intervals;  // 95 %, one for each mode
  // Covariance of (log f, log ζ, g) for each mode in turn: 3n rows of 3n numbers.
  std::vector<double> covariance;
  double unexplained = 0.0;  // share of the measurement that the fit does not explain, 0 to 1
  bool is_minimum_phase = true;
  int column = -1;            // as AxisDensity's
  std::vector<Plant> plants;  // the fit first; shares add up to 1
  Curve curve;                // the density, relative to its mean, over frequency in Hz
  std::vector<std::vector<double>> mode_curves;  // each mode alone
  std::vector<double> noise_curve;
  // Bayesian information criterion of the best fit with 0, 1, 2 … modes, trusted or not. With no
  // mode, the tool moves as the base does.
  std::vector<double> bic;
  std::vector<std::string> warnings;
};

[[nodiscard]] AxisDensity density_of_axis(const Spectrum& spectrum, const Sweep& sweep);

// Errors are of kind input: too few frequencies, no motion, or no model that can be trusted, with
// the reason and what to do.
[[nodiscard]] Result<ModesFit> fit_modes(const Spectrum& spectrum, const Sweep& sweep);

}  // namespace unflex::identify
