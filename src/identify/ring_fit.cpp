// Once the base is at rest the nozzle's acceleration is
//   y(t) = e^(−ζωt) (a cos ω_d t + b sin ω_d t) + c,   ω_d = ω√(1−ζ²),
// c being gravity. The record does not say when the base comes to rest. We take the earliest moment
// after the peak from which on this fits about as well as from any later one.
//
// Known modes may ring along. Each adds such a term of its own frequency and damping, whose a and b
// are free.
#include "ring_fit.hpp"

#include <fmt/core.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "fourier.hpp"
#include "least_squares.hpp"
#include "modes_interval.hpp"
#include "unflex/core/math.hpp"

namespace unflex::identify {
namespace {

constexpr Eigen::Index kFewestSamples = 48;
constexpr double kLowest_hz = 5.0;
constexpr double kHighest_hz = 250.0;
// A faster decay is over before the nozzle has swung to and fro.
constexpr double kMostDamping = 0.4;

using Known = std::vector<ModeOfAxis>;

// e^(−ζωt) cos ω_d t and e^(−ζωt) sin ω_d t. A ζ above kGreatest counts as kGreatest.
struct Swings {
  Eigen::ArrayXd cosine;
  Eigen::ArrayXd sine;
};

Swings swings(const Eigen::ArrayXd& time_s, double freq_hz, double given_damping_ratio) {
  constexpr double kGreatest = 0.95;
  const double damping_ratio = std::min(given_damping_ratio, kGreatest);
  const double omega = 2.0 * std::numbers::pi * freq_hz;
  const double omega_d = omega * std::sqrt(1.0 - damping_ratio * damping_ratio);
  const Eigen::ArrayXd envelope = (-damping_ratio * omega * time_s).unaryExpr(&math::exp);
  const Eigen::ArrayXd phase = omega_d * time_s;
  return {envelope * phase.unaryExpr(&math::cos), envelope * phase.unaryExpr(&math::sin)};
}

// The model; p is ln f, ln ζ, a, b, c, then a and b of each known mode.
Eigen::ArrayXd ringing(const Eigen::ArrayXd& time_s, const Eigen::VectorXd& p, const Known& known) {
  const Swings own = swings(time_s, math::exp(p[0]), math::exp(p[1]));
  Eigen::ArrayXd sum = p[2] * own.cosine + p[3] * own.sine + p[4];
  Eigen::Index at = 5;
  for (const ModeOfAxis& mode : known) {
    const Swings other = swings(time_s, mode.freq_hz, mode.damping_ratio);
    sum += p[at] * other.cosine + p[at + 1] * other.sine;
    at += 2;
  }
  return sum;
}

// The best amplitudes and c for a frequency and a damping ratio.
Eigen::VectorXd with_amplitudes(const Eigen::ArrayXd& time_s, const Eigen::ArrayXd& data,
                                double freq_hz, double damping_ratio, const Known& known) {
  const Eigen::Index amplitudes = 3 + 2 * static_cast<Eigen::Index>(known.size());
  Eigen::VectorXd p = Eigen::VectorXd::Zero(2 + amplitudes);
  p.head(2) << math::log(freq_hz), math::log(damping_ratio);
  Eigen::MatrixXd columns(data.size(), amplitudes);
  for (Eigen::Index column = 0; column < amplitudes; ++column) {
    Eigen::VectorXd unit = p;
    unit[2 + column] = 1.0;
    columns.col(column) = ringing(time_s, unit, known).matrix();
  }
  p.tail(amplitudes) = columns.colPivHouseholderQr().solve(data.matrix());
  return p;
}

// Whether the frequency is far enough from all known ones to be another mode's.
bool is_apart(double freq_hz, const Known& known) {
  return std::ranges::none_of(known, [&](const ModeOfAxis& mode) {
    return std::abs(freq_hz / mode.freq_hz - 1.0) < kApartOfKnown;
  });
}

std::optional<double> strongest_hz(const Eigen::ArrayXd& data, double rate_hz, const Known& known) {
  // A few oscillations make a broad peak. Zeros behind them show where its top is.
  const auto length = static_cast<std::size_t>(std::max<Eigen::Index>(4096, data.size()));
  std::vector<double> padded(length, 0.0);
  const double mean = data.tail(data.size() / 4).mean();
  for (Eigen::Index i = 0; i < data.size(); ++i) {
    padded[static_cast<std::size_t>(i)] = data[i] - mean;
  }
  const EnergySpectrum spectrum = energy_spectrum(padded, rate_hz);
  const auto first = static_cast<Eigen::Index>(std::ceil(kLowest_hz / spectrum.step_hz));
  const auto last = std::min(static_cast<Eigen::Index>(kHighest_hz / spectrum.step_hz),
                             spectrum.energy.size() - 1);
  if (last <= first) {
    return std::nullopt;
  }
  double most = 0.0;
  std::optional<double> strongest;
  for (Eigen::Index k = first; k < last; ++k) {
    const double freq_hz = static_cast<double>(k) * spectrum.step_hz;
    if (spectrum.energy[k] > most && is_apart(freq_hz, known)) {
      most = spectrum.energy[k];
      strongest = freq_hz;
    }
  }
  return strongest;
}

struct Ringing {
  LeastSquares fit;
  double spread = 0.0;  // standard deviation of the residual
  Eigen::ArrayXd time_s;
  Eigen::ArrayXd data;

  [[nodiscard]] double amplitude() const {
    return math::hypot(fit.parameters[2], fit.parameters[3]);
  }
};

std::optional<Ringing> fit_from(const Eigen::ArrayXd& all, Eigen::Index start, double rate_hz,
                                const Known& known) {
  Ringing result;
  result.data = all.tail(all.size() - start);
  result.time_s = Eigen::ArrayXd::LinSpaced(result.data.size(), 0.0,
                                            static_cast<double>(result.data.size() - 1) / rate_hz);
  const std::optional<double> guess_hz = strongest_hz(result.data, rate_hz, known);
  if (!guess_hz) {
    return std::nullopt;
  }
  const Eigen::ArrayXd weights = Eigen::ArrayXd::Ones(result.data.size());
  const Model model = [&](const Eigen::VectorXd& p) { return ringing(result.time_s, p, known); };
  bool is_first = true;
  for (const double damping_ratio : {0.03, 0.12}) {
    LeastSquares fit =
        minimise(model, result.data, weights,
                 with_amplitudes(result.time_s, result.data, *guess_hz, damping_ratio, known));
    if (is_first || fit.weighted_sum < result.fit.weighted_sum) {
      result.fit = std::move(fit);
      is_first = false;
    }
  }
  const double freq_hz = math::exp(result.fit.parameters[0]);
  result.spread = std::sqrt(result.fit.weighted_sum /
                            static_cast<double>(result.data.size() - result.fit.parameters.size()));
  const bool usable = freq_hz > kLowest_hz && freq_hz < kHighest_hz &&
                      math::exp(result.fit.parameters[1]) < kMostDamping &&
                      is_apart(freq_hz, known);
  return usable ? std::optional(std::move(result)) : std::nullopt;
}

// Fits from places between the peak and two thirds of what follows. Returns the first fit that is
// as good as the best.
std::optional<Ringing> earliest_good(const Eigen::ArrayXd& all, Eigen::Index peak, double rate_hz,
                                     const Known& known) {
  constexpr Eigen::Index kStarts = 24;
  constexpr double kAboveNoise = 3.0;
  std::vector<Ringing> found;
  const Eigen::Index room = (all.size() - peak) * 2 / 3;
  for (Eigen::Index i = 0; i < kStarts; ++i) {
    const Eigen::Index start = peak + room * i / kStarts;
    if (all.size() - start < kFewestSamples) {
      break;
    }
    std::optional<Ringing> candidate = fit_from(all, start, rate_hz, known);
    if (candidate && candidate->amplitude() > kAboveNoise * candidate->spread) {
      found.push_back(std::move(*candidate));
    }
  }
  const auto best = std::ranges::min_element(found, {}, &Ringing::spread);
  // A spread counts as good as the best one if chance alone explains the difference.
  const auto first = std::ranges::find_if(found, [&](const Ringing& r) {
    const double chance = 2.5 / std::sqrt(2.0 * static_cast<double>(r.data.size()));
    return r.spread <= (1.0 + chance) * best->spread;
  });
  return first == found.end() ? std::nullopt : std::optional(std::move(*first));
}

// Where the ringing can begin at the earliest: at the peak, or, behind a move whose beginning is
// part of the record, at the last place that is nearly as high.
Eigen::Index peak_of(const Eigen::ArrayXd& all, bool is_last) {
  constexpr double kNearlyAsHigh = 0.6;
  const Eigen::ArrayXd height = (all - all.tail(all.size() / 5).mean()).abs();
  Eigen::Index peak = 0;
  const double highest = height.maxCoeff(&peak);
  for (Eigen::Index i = height.size(); is_last && i-- > peak;) {
    if (height[i] >= kNearlyAsHigh * highest) {
      return i;
    }
  }
  return peak;
}

}  // namespace

Result<RecordFit> fit_ringing(const std::vector<double>& samples, double rate_hz,
                              const std::vector<ModeOfAxis>& known) {
  const Eigen::Map<const Eigen::ArrayXd> given(samples.data(),
                                               static_cast<Eigen::Index>(samples.size()));
  if (given.size() < 2 * kFewestSamples || !(given.minCoeff() < given.maxCoeff())) {
    return fail(ErrorKind::input, "there is no motion in it, or it is too short");
  }
  const double height = (given - given.mean()).abs().maxCoeff();
  const Eigen::ArrayXd all = (given - given.mean()) / height;
  const std::optional<Ringing> ring =
      earliest_good(all, peak_of(all, !known.empty()), rate_hz, known);
  if (!ring) {
    return fail(
        ErrorKind::input,
        known.empty()
            ? "no ringing stands out of the noise; record a sweep, or the stop after a fast move"
            : "no ringing but that of the known modes stands out of the noise, so that there is "
              "nothing for a second stage; leave [second] out");
  }
  const Eigen::ArrayXd weights = Eigen::ArrayXd::Ones(ring->data.size());
  const auto period = std::max<Eigen::Index>(
      1, static_cast<Eigen::Index>(rate_hz / math::exp(ring->fit.parameters[0])));
  const double freq_hz = math::exp(ring->fit.parameters[0]);
  const double damping_ratio = math::exp(ring->fit.parameters[1]);
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(3, 3);
  covariance.topLeftCorner(2, 2) = sandwich(ring->fit, weights, period).topLeftCorner(2, 2);
  RecordFit record;
  record.model = model_of(Method::ringing, {{freq_hz, damping_ratio}}, covariance);
  // The unexplained share is taken over the stretch that rings, without the noise behind it.
  const double time_constant_s = 1.0 / (2.0 * std::numbers::pi * freq_hz * damping_ratio);
  const auto shown =
      std::clamp<Eigen::Index>(static_cast<Eigen::Index>(4.0 * time_constant_s * rate_hz),
                               kFewestSamples, ring->data.size());
  const Eigen::ArrayXd signal = ring->data.head(shown) - ring->fit.parameters[4];
  record.unexplained = std::min(
      1.0, std::sqrt(ring->fit.residual.head(shown).square().sum() / signal.square().sum()));
  constexpr double kTooMuch = 0.5;
  // A vibration that lasts a hundred periods, or is faster than any belt swings, is a motor's step.
  constexpr double kLeastDamping = 0.005;
  constexpr double kFastest_hz = 180.0;
  if (record.unexplained > kTooMuch) {
    record.refusal =
        "one mode does not explain this: the decay is noise or several resonances; record a sweep, "
        "or the stop after a faster move";
  }
  if (damping_ratio < kLeastDamping || freq_hz > kFastest_hz) {
    record.refusal = fmt::format(
        "what sounds in it at {:.1f} Hz is no belt but a motor or a fan; record a sweep, or the "
        "stop "
        "after a fast move",
        freq_hz);
  }
  record.curve.is_spectrum = false;
  for (Eigen::Index i = 0; i < shown; ++i) {
    record.curve.x.push_back(ring->time_s[i]);
    record.curve.measured.push_back(ring->data[i]);
    record.curve.fitted.push_back(ring->data[i] - ring->fit.residual[i]);
  }
  return record;
}

}  // namespace unflex::identify
