#include "unflex/rivals/klipper_calibration.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "unflex/core/math.hpp"

namespace unflex::rivals {
namespace {

using dynamics::ShaperKind;
using dynamics::ShaperPulses;

constexpr double kDampingRatio = 0.1;
constexpr double kMost_hz = 200.0;

struct Candidate {
  ShaperKind kind;
  double least_hz;
};
constexpr std::array<Candidate, 5> kCandidates = {{{ShaperKind::zv, 21.0},
                                                   {ShaperKind::mzv, 23.0},
                                                   {ShaperKind::ei, 29.0},
                                                   {ShaperKind::two_hump_ei, 39.0},
                                                   {ShaperKind::three_hump_ei, 48.0}}};

struct Bins {
  Eigen::ArrayXd freq_hz;
  Eigen::ArrayXd density;
};

// The density over frequency, without what lies at low frequencies.
Bins bins_of(double step_hz, const std::vector<double>& density) {
  constexpr double kLow_hz = 10.0;
  const auto count = std::min(static_cast<Eigen::Index>(density.size()),
                              static_cast<Eigen::Index>(kMost_hz / step_hz) + 1);
  Bins bins{Eigen::ArrayXd(count), Eigen::ArrayXd(count)};
  for (Eigen::Index k = 0; k < count; ++k) {
    const double freq_hz = static_cast<double>(k) * step_hz;
    const double share =
        freq_hz < kLow_hz ? math::exp(1.0 - math::square(kLow_hz / (freq_hz + 0.1))) : 1.0;
    bins.freq_hz[k] = freq_hz;
    bins.density[k] = share * density[static_cast<std::size_t>(k)] / (freq_hz + 0.1);
  }
  return bins;
}

// The amplitude that the pulses leave of a vibration, by its frequency.
Eigen::ArrayXd left_of(const ShaperPulses& pulses, double damping_ratio,
                       const Eigen::ArrayXd& freq_hz) {
  const Eigen::ArrayXd omega = 2.0 * std::numbers::pi * freq_hz;
  const double damped = std::sqrt(1.0 - damping_ratio * damping_ratio);
  Eigen::ArrayXd sine = Eigen::ArrayXd::Zero(freq_hz.size());
  Eigen::ArrayXd cosine = sine;
  for (const dynamics::Pulse& pulse : pulses) {
    const Eigen::ArrayXd decayed =
        pulse.weight *
        (-damping_ratio * omega * (pulses.back().time_s - pulse.time_s)).unaryExpr(&math::exp);
    const Eigen::ArrayXd phase = damped * omega * pulse.time_s;
    sine += decayed * phase.unaryExpr(&math::sin);
    cosine += decayed * phase.unaryExpr(&math::cos);
  }
  return (sine.square() + cosine.square()).sqrt();
}

double vibration_of(const ShaperPulses& pulses, const Bins& bins) {
  constexpr std::array kDampingRatios = {0.075, 0.1, 0.15};
  constexpr double kUnseen = 1.0 / 20.0;  // no shaper reduces vibrations further
  const double unseen = kUnseen * bins.density.maxCoeff();
  const double all = (bins.density - unseen).max(0.0).sum();
  double worst = 0.0;
  for (const double damping_ratio : kDampingRatios) {
    const Eigen::ArrayXd left = left_of(pulses, damping_ratio, bins.freq_hz);
    worst = std::max(worst, (left * bins.density - unseen).max(0.0).sum() / all);
  }
  return worst;
}

// How far a shaper leads off the path at a right angle, which is passed at kCalibrationCorner_mm_s,
// and at a reversal. Both are linear in the acceleration.
struct Smoothing {
  double corner_mm = 0.0;
  double corner_per_accel_s2 = 0.0;
  double reversal_per_accel_s2 = 0.0;
};

// The pulses' mean time is 0.
Smoothing smoothing_of(const ShaperPulses& pulses) {
  Smoothing sum;
  for (const dynamics::Pulse& pulse : pulses) {
    const double t = pulse.time_s;
    if (t >= 0.0) {
      sum.corner_mm += std::numbers::sqrt2 * pulse.weight * kCalibrationCorner_mm_s * t;
      sum.corner_per_accel_s2 += std::numbers::sqrt2 * pulse.weight * 0.5 * t * t;
    }
    sum.reversal_per_accel_s2 += pulse.weight * 0.5 * t * t;
  }
  return sum;
}

double smoothing_mm(const ShaperPulses& pulses) {
  constexpr double kAccel_mm_s2 = 5000.0;
  const Smoothing of = smoothing_of(pulses);
  return std::max(of.corner_mm + kAccel_mm_s2 * of.corner_per_accel_s2,
                  kAccel_mm_s2 * of.reversal_per_accel_s2);
}

// The shaper at all frequencies, the lowest first.
std::vector<FittedShaper> tried(const Candidate& candidate, const Bins& bins) {
  constexpr double kMostOfShaper_hz = 150.0;
  constexpr double kStep_hz = 0.2;
  std::vector<FittedShaper> results;
  for (int k = 0; candidate.least_hz + k * kStep_hz < kMostOfShaper_hz; ++k) {
    FittedShaper one{.kind = candidate.kind, .freq_hz = candidate.least_hz + k * kStep_hz};
    const ShaperPulses pulses = one.pulses();
    one.vibration = vibration_of(pulses, bins);
    one.smoothing_mm = smoothing_mm(pulses);
    const double v = one.vibration;
    one.score = one.smoothing_mm * (math::pow(v, 1.5) + 0.2 * v + 0.01);
    results.push_back(one);
  }
  return results;
}

// The shaper that smooths much less than the one that leaves least, but leaves not much more.
FittedShaper selected(const std::vector<FittedShaper>& results) {
  // Among equals the highest frequency counts.
  const auto least =
      std::ranges::min_element(results.rbegin(), results.rend(), {}, &FittedShaper::vibration);
  FittedShaper best = *least;
  for (const FittedShaper& one : results) {
    if (one.vibration < 1.1 * least->vibration + 0.0005 && one.score < best.score) {
      best = one;
    }
  }
  return best;
}

}  // namespace

ShaperPulses FittedShaper::pulses() const {
  return *dynamics::shaper_pulses(kind, freq_hz, kDampingRatio);
}

std::vector<double> amplitude_left(const ShaperPulses& pulses, const std::vector<double>& freq_hz) {
  const Eigen::ArrayXd left = left_of(
      pulses, kDampingRatio,
      Eigen::Map<const Eigen::ArrayXd>(freq_hz.data(), static_cast<Eigen::Index>(freq_hz.size())));
  return {left.begin(), left.end()};
}

double advised_accel_mm_s2(const ShaperPulses& pulses) {
  constexpr double kMostSmoothing_mm = 0.12;  // TARGET_SMOOTHING
  const Smoothing of = smoothing_of(pulses);
  return std::max(0.0, std::min((kMostSmoothing_mm - of.corner_mm) / of.corner_per_accel_s2,
                                kMostSmoothing_mm / of.reversal_per_accel_s2));
}

const FittedShaper& KlipperCalibration::of(ShaperKind kind) const {
  return *std::ranges::find(shapers, kind, &FittedShaper::kind);
}

std::optional<KlipperCalibration> klipper_calibration(double step_hz,
                                                      const std::vector<double>& density) {
  const Bins bins = bins_of(step_hz, density);
  if (bins.density.size() == 0 || !(bins.density.maxCoeff() > 0.0)) {
    return std::nullopt;
  }
  KlipperCalibration calibration;
  std::optional<FittedShaper> best;
  for (const Candidate& candidate : kCandidates) {
    const std::vector<FittedShaper> results = tried(candidate, bins);
    FittedShaper shaper = selected(results);
    if (!best || 1.2 * shaper.score < best->score ||
        (1.05 * shaper.score < best->score && 1.1 * shaper.smoothing_mm < best->smoothing_mm)) {
      best = shaper;
    }
    // Any frequency at which it leaves and smooths less than the best so far.
    for (const FittedShaper& one : results) {
      if (one.vibration < best->vibration && one.smoothing_mm < best->smoothing_mm) {
        best = shaper = one;
      }
    }
    calibration.shapers.push_back(shaper);
  }
  if (best->kind == ShaperKind::zv) {
    const auto better = std::ranges::find_if(calibration.shapers, [&](const FittedShaper& one) {
      return one.kind != ShaperKind::zv && 1.1 * one.vibration < best->vibration;
    });
    best = better != calibration.shapers.end() ? *better : *best;
  }
  calibration.recommended = *best;
  return calibration;
}

}  // namespace unflex::rivals
