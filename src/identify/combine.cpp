#include <algorithm>
#include <array>
#include <cmath>

#include "response.hpp"
#include "ring_fit.hpp"
#include "sweep_fit.hpp"
#include "unflex/identify/mode.hpp"

namespace unflex::identify {
namespace {

constexpr double kQuantile = 1.959964;

// Mean of logarithms, weighted by their intervals. If the values scatter more than their intervals
// tell, the interval of the mean grows by as much (Birge, The Calculation of Errors by the Method
// of Least Squares, 1932).
Estimate mean_of(const std::vector<Mode>& modes, Estimate Mode::*which) {
  double weights = 0.0;
  double sum = 0.0;
  for (const Mode& mode : modes) {
    const Estimate& e = mode.*which;
    const double spread = std::max(std::log(e.high / e.low) / (2.0 * kQuantile), 1e-9);
    weights += 1.0 / (spread * spread);
    sum += std::log(e.value) / (spread * spread);
  }
  const double mean = sum / weights;
  double scatter = 0.0;
  for (const Mode& mode : modes) {
    const Estimate& e = mode.*which;
    const double spread = std::max(std::log(e.high / e.low) / (2.0 * kQuantile), 1e-9);
    scatter += std::pow((std::log(e.value) - mean) / spread, 2);
  }
  const double excess = modes.size() > 1 ? scatter / static_cast<double>(modes.size() - 1) : 1.0;
  return estimate_of(std::exp(mean), std::max(1.0, excess) / weights);
}

// How much an axis moved. Differences of neighbours favour the band in which resonances are.
double motion(const std::vector<double>& samples) {
  double sum = 0.0;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    sum += std::pow(samples[i] - samples[i - 1], 2);
  }
  return sum;
}

double motion(const DataSet& set, std::size_t axis) {
  if (const auto* recording = std::get_if<Recording>(&set.data)) {
    return motion(recording->accel[axis]);
  }
  double sum = 0.0;
  for (const double density : std::get<Spectrum>(set.data).density[axis]) {
    sum += density;
  }
  return sum;
}

// Whether the value lies in a finite interval above 0.
bool is_known(const Estimate& estimate) {
  return estimate.low > 0.0 && estimate.low <= estimate.value && estimate.value <= estimate.high &&
         std::isfinite(estimate.high);
}

}  // namespace

std::string_view to_string(Method method) {
  constexpr std::array<std::string_view, 5> kNames = {"sweep", "spectrum", "ringing", "tower",
                                                      "combined"};
  return kNames[static_cast<std::size_t>(method)];
}

Axis dominant_axis(const DataSet& set) {
  return motion(set, 1) > motion(set, 0) ? Axis::y : Axis::x;
}

Result<Mode> fit_recording(const Recording& recording, Axis axis, const Sweep& sweep) {
  const std::vector<double>& samples = recording.accel[axis == Axis::x ? 0 : 1];
  return holds_sweep(samples, recording.rate_hz) ? fit_sweep(samples, recording.rate_hz, sweep)
                                                 : fit_ringing(samples, recording.rate_hz);
}

Result<Mode> fit(const DataSet& set, Axis axis, const Sweep& sweep) {
  const auto* recording = std::get_if<Recording>(&set.data);
  Result<Mode> mode = recording != nullptr
                          ? fit_recording(*recording, axis, sweep)
                          : fit_spectrum(std::get<Spectrum>(set.data), axis, sweep);
  if (!mode) {
    return fail(mode.error().kind, {set.name, 0}, mode.error().message);
  }
  // Such numbers do not describe a resonance.
  if (!is_known(mode->freq_hz) || !is_known(mode->damping_ratio) ||
      !(mode->damping_ratio.value < 1.0)) {
    return fail(ErrorKind::input, {set.name, 0}, "no resonance can be made out in it");
  }
  return mode;
}

Mode combine(const std::vector<Mode>& modes) {
  if (modes.size() == 1) {
    return modes.front();
  }
  Mode mode;
  mode.method = Method::combined;
  mode.freq_hz = mean_of(modes, &Mode::freq_hz);
  mode.damping_ratio = mean_of(modes, &Mode::damping_ratio);
  for (const Mode& one : modes) {
    mode.unexplained = std::max(mode.unexplained, one.unexplained);
  }
  return mode;
}

}  // namespace unflex::identify
