// The fit uses the energy spectrum |Y(ν)|² of the whole recording without its phase. So neither the
// moment at which the sweep began nor the clocks matter. Y is the mode's answer to the sweep, with
// energy s, plus white noise of mean energy S, independent from bin to bin; then (Rice,
// Mathematical Analysis of Random Noise, 1945)
//   E|Y|² = s + S,   var|Y|² = 2 s S + S².
// s is c·E(ν)·|H(ν)|² (response.hpp) but for a ripple of some percent. The ripple arises where the
// third harmonic of an earlier moment meets the fundamental. It changes fast enough with ν to count
// as noise.
#include "sweep_fit.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "fourier.hpp"
#include "least_squares.hpp"
#include "response.hpp"

namespace unflex::identify {
namespace {

// The spectrum in the band of the sweep; each value is the mean of `values_each` bins.
struct Band {
  Eigen::ArrayXd freq_hz;
  Eigen::ArrayXd energy;
  double step_hz = 0.0;
  double values_each = 1.0;
};

constexpr double kSamplesPerPeriod = 2.5;
constexpr double kGroup_hz = 0.04;
// At lower frequencies the slow to and fro that newer Klippers add to the sweep is stronger.
constexpr double kLowest_hz = 12.0;

// So many standard deviations above the model, a value is a line of this to and fro: noise and
// ripple do not get there.
constexpr double kOutlier = 8.0;

Eigen::ArrayXd variance(const Eigen::ArrayXd& signal, double noise, double values_each) {
  constexpr double kRipple = 0.09;
  return (2.0 * signal * noise + noise * noise + (kRipple * signal).square()) / values_each;
}

Band band_of(const EnergySpectrum& spectrum, const Sweep& sweep) {
  const double low_hz = std::max(kLowest_hz, 1.2 * sweep.start_hz);
  const auto first = static_cast<Eigen::Index>(std::ceil(low_hz / spectrum.step_hz));
  const auto last = std::min(static_cast<Eigen::Index>(sweep.end_hz / spectrum.step_hz),
                             spectrum.energy.size() - 1);
  const auto each = std::max<Eigen::Index>(
      1, static_cast<Eigen::Index>(std::lround(kGroup_hz / spectrum.step_hz)));
  const Eigen::Index groups = std::max<Eigen::Index>(0, (last - first) / each);
  Band band{.freq_hz = Eigen::ArrayXd(groups),
            .energy = Eigen::ArrayXd(groups),
            .step_hz = spectrum.step_hz * static_cast<double>(each),
            .values_each = static_cast<double>(each)};
  for (Eigen::Index i = 0; i < groups; ++i) {
    const Eigen::Index at = first + i * each;
    band.energy[i] = spectrum.energy.segment(at, each).mean();
    band.freq_hz[i] =
        (static_cast<double>(at) + 0.5 * static_cast<double>(each - 1)) * spectrum.step_hz;
  }
  return band;
}

Eigen::ArrayXd model_of(const Band& band, const Eigen::ArrayXd& excitation,
                        const SpectrumParameters& p) {
  return p.scale * excitation * gain_squared(band.freq_hz, p.mode_hz, p.damping_ratio) + p.noise;
}

// Weights for parameters near the right ones.
Eigen::ArrayXd weights_at(const Band& band, const Eigen::ArrayXd& model, double noise) {
  const Eigen::ArrayXd spread = variance(model - noise, noise, band.values_each);
  return (band.energy - model > kOutlier * spread.sqrt()).select(0.0, spread.inverse()).eval();
}

// The frequency at which the response is highest against the excitation, in means over 1 Hz.
double first_guess_hz(const Band& band) {
  const auto width = static_cast<Eigen::Index>(1.0 / band.step_hz);
  double best = 0.0;
  double best_hz = 40.0;
  for (Eigen::Index i = 0; i + width < band.energy.size();
       i += std::max<Eigen::Index>(width / 4, 1)) {
    const double freq_hz = band.freq_hz[i + width / 2];
    const double height = band.energy.segment(i, width).mean() / freq_hz;
    if (height > best) {
      best = height;
      best_hz = freq_hz;
    }
  }
  return best_hz;
}

struct Candidate {
  LeastSquares fit;
  Eigen::ArrayXd weights;
  double cost = 0.0;
};

// The weights follow from the fit and the fit from the weights, so we repeat both. The cost
// compares candidates by the likelihood of their residuals.
Candidate refine(const Band& band, const Eigen::ArrayXd& excitation, SpectrumParameters start) {
  constexpr int kRounds = 6;
  const Model model = [&](const Eigen::VectorXd& logarithms) {
    return model_of(band, excitation, SpectrumParameters::from(logarithms));
  };
  Candidate candidate;
  Eigen::VectorXd at = start.logarithms();
  for (int round = 0; round < kRounds; ++round) {
    candidate.weights = weights_at(band, model(at), SpectrumParameters::from(at).noise);
    candidate.fit = minimise(model, band.energy, candidate.weights, at);
    at = candidate.fit.parameters;
  }
  const SpectrumParameters p = SpectrumParameters::from(at);
  const Eigen::ArrayXd spread = variance(model(at) - p.noise, p.noise, band.values_each);
  candidate.cost =
      ((candidate.fit.residual.square() / spread).min(kOutlier * kOutlier) + spread.log()).sum();
  return candidate;
}

Candidate best_of(const Band& band, const Eigen::ArrayXd& excitation) {
  const double guess_hz = first_guess_hz(band);
  Candidate best;
  for (const double damping_ratio : {0.03, 0.1, 0.25}) {
    SpectrumParameters start{guess_hz, damping_ratio, 1.0, 0.05};
    start.scale = 1.0 / (excitation * gain_squared(band.freq_hz, guess_hz, damping_ratio)).mean();
    Candidate candidate = refine(band, excitation, start);
    if (best.weights.size() == 0 || candidate.cost < best.cost) {
      best = std::move(candidate);
    }
  }
  return best;
}

// The curve in steps of 1 Hz.
Curve curve_of(const Band& band, const Eigen::ArrayXd& fitted) {
  const auto one_hz = static_cast<Eigen::Index>(1.0 / band.step_hz);
  Curve curve;
  for (Eigen::Index i = 0; i + one_hz <= band.energy.size(); i += one_hz) {
    curve.x.push_back(band.freq_hz.segment(i, one_hz).mean());
    curve.measured.push_back(band.energy.segment(i, one_hz).mean());
    curve.fitted.push_back(fitted.segment(i, one_hz).mean());
  }
  return curve;
}

}  // namespace

bool holds_sweep(const std::vector<double>& samples, double rate_hz) {
  constexpr double kShortest_s = 10.0;
  return static_cast<double>(samples.size()) / rate_hz > kShortest_s;
}

Result<Mode> fit_sweep(const std::vector<double>& samples, double rate_hz, const Sweep& sweep) {
  if (rate_hz < kSamplesPerPeriod * sweep.end_hz) {
    return fail(ErrorKind::input,
                fmt::format("{:.0f} samples a second do not show a sweep up to {:g} Hz; say with "
                            "--freq-end, at most {:.0f}, where the test ended",
                            rate_hz, sweep.end_hz, std::floor(rate_hz / kSamplesPerPeriod)));
  }
  const auto [least, most] = std::ranges::minmax(samples);
  Band band = band_of(energy_spectrum(samples, rate_hz), sweep);
  if (band.energy.size() < 100 || !(least < most)) {
    return fail(ErrorKind::input, "there is no motion in the band of the sweep");
  }
  band.energy /= band.energy.mean();
  const Eigen::ArrayXd excitation = sweep_energy(band.freq_hz, sweep.start_hz);
  const Candidate best = best_of(band, excitation);
  const SpectrumParameters p = SpectrumParameters::from(best.fit.parameters);
  const Eigen::ArrayXd fitted = model_of(band, excitation, p);
  // White noise looks like a mode far below the band that is nearly all damper.
  constexpr double kFlat = 3.0;
  if (fitted.maxCoeff() < kFlat * fitted.minCoeff()) {
    return fail(ErrorKind::input, "no resonance stands out of the noise in it");
  }
  // Deviations that are not noise go together over some tenths of a Hz.
  const auto block = static_cast<Eigen::Index>(0.5 / band.step_hz);
  const Eigen::MatrixXd alone = sandwich(best.fit, best.weights, 1);
  const Eigen::MatrixXd together = sandwich(best.fit, best.weights, block);
  Mode mode;
  mode.method = Method::sweep;
  mode.freq_hz = estimate_of(p.mode_hz, std::max(alone(0, 0), together(0, 0)));
  mode.damping_ratio = estimate_of(p.damping_ratio, std::max(alone(1, 1), together(1, 1)));
  const auto one_hz = static_cast<Eigen::Index>(1.0 / band.step_hz);
  add_warnings(misfit_of(band.freq_hz, band.energy, fitted, p.noise, one_hz), sweep, mode);
  mode.curve = curve_of(band, fitted);
  return mode;
}

}  // namespace unflex::identify
