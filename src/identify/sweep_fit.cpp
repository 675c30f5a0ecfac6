// The fit by Welch's spectrum (modes_fit.hpp) tells how many modes there are and about where. Then
// all their parameters are fitted to the energy spectrum |Y(ν)|² of the whole recording, which is
// finer by a factor of forty, without its phase. So neither the moment at which the sweep began nor
// the clocks matter. Y is the modes' answer to the sweep, with energy s, plus noise of mean
// energy S, independent from bin to bin; then (Rice, Mathematical Analysis of Random Noise, 1945)
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
#include "modes_fit.hpp"
#include "modes_interval.hpp"
#include "modes_model.hpp"
#include "response.hpp"
#include "unflex/core/math.hpp"
#include "welch.hpp"

namespace unflex::identify {
namespace {

// The spectrum in the band of the sweep; each value is the mean of `values_each` bins.
struct FineBand {
  Eigen::ArrayXd freq_hz;
  Eigen::ArrayXd energy;
  double step_hz = 0.0;
  double values_each = 1.0;
};

constexpr double kSamplesPerPeriod = 2.5;
constexpr double kGroup_hz = 0.04;
// At lower frequencies the slow to and fro that newer Klippers add to the sweep is stronger.
constexpr double kLowest_hz = 12.0;

// A value this many standard deviations above the model is a line of the slow to and fro. Noise and
// ripple do not get there.
constexpr double kOutlier = 8.0;

Eigen::ArrayXd variance(const Eigen::ArrayXd& signal, const Eigen::ArrayXd& noise,
                        double values_each) {
  constexpr double kRipple = 0.09;
  return (2.0 * signal * noise + noise.square() + (kRipple * signal).square()) / values_each;
}

FineBand fine_band_of(const EnergySpectrum& spectrum, const Sweep& sweep) {
  const double low_hz = std::max(kLowest_hz, 1.2 * sweep.start_hz);
  const auto first = static_cast<Eigen::Index>(std::ceil(low_hz / spectrum.step_hz));
  const auto last = std::min(static_cast<Eigen::Index>(sweep.end_hz / spectrum.step_hz),
                             spectrum.energy.size() - 1);
  const auto each = std::max<Eigen::Index>(
      1, static_cast<Eigen::Index>(std::lround(kGroup_hz / spectrum.step_hz)));
  const Eigen::Index groups = std::max<Eigen::Index>(0, (last - first) / each);
  FineBand band{.freq_hz = Eigen::ArrayXd(groups),
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

// Parameters are those of ModesModel: log f, log ζ and a for each mode, then log N₀ and log N₁.
Eigen::ArrayXd noise_of(const Eigen::ArrayXd& freq_hz, const Eigen::VectorXd& p) {
  return math::exp(p[p.size() - 2]) + math::exp(p[p.size() - 1]) * noise_rise(freq_hz);
}

// The answer of mode m alone at frequencies ν.
Eigen::ArrayXcd answer(const Eigen::ArrayXd& freq_hz, const Eigen::VectorXd& p, Eigen::Index m) {
  return p[3 * m + 2] * mode_response(freq_hz, math::exp(p[3 * m]), math::exp(p[3 * m + 1]));
}

Eigen::ArrayXd energy_of(const Eigen::ArrayXd& freq_hz, const Eigen::ArrayXd& excitation,
                         const Eigen::VectorXd& p) {
  Eigen::ArrayXcd sum = Eigen::ArrayXcd::Zero(freq_hz.size());
  for (Eigen::Index m = 0; m < modes_in(p); ++m) {
    sum += answer(freq_hz, p, m);
  }
  return excitation * sum.abs2() + noise_of(freq_hz, p);
}

// Weights for parameters near the right ones.
Eigen::ArrayXd weights_at(const FineBand& band, const Eigen::ArrayXd& model,
                          const Eigen::ArrayXd& noise) {
  const Eigen::ArrayXd spread = variance(model - noise, noise, band.values_each);
  return (band.energy - model > kOutlier * spread.sqrt()).select(0.0, spread.inverse()).eval();
}

struct FineFit {
  LeastSquares fit;
  Eigen::ArrayXd weights;
};

// The weights follow from the fit and the fit from the weights, so we repeat both.
FineFit refine(const FineBand& band, const Eigen::ArrayXd& excitation, Eigen::VectorXd at) {
  constexpr int kRounds = 6;
  const Model model = [&](const Eigen::VectorXd& p) {
    return energy_of(band.freq_hz, excitation, p);
  };
  FineFit fine;
  for (int round = 0; round < kRounds; ++round) {
    fine.weights = weights_at(band, model(at), noise_of(band.freq_hz, at));
    fine.fit = minimise(model, band.energy, fine.weights, at);
    at = fine.fit.parameters;
  }
  return fine;
}

// θ of a coarse fit as a start.
Eigen::VectorXd start_of(const FineBand& band, const Eigen::ArrayXd& excitation,
                         const Eigen::VectorXd& theta) {
  constexpr double kFirstNoise = 0.05;
  Eigen::VectorXd start = theta;
  start.tail(2).setConstant(math::log(kFirstNoise));
  const double mean =
      (energy_of(band.freq_hz, excitation, start) - noise_of(band.freq_hz, start)).mean();
  for (Eigen::Index m = 0; m < modes_in(start); ++m) {
    start[3 * m + 2] /= std::sqrt(mean);
  }
  return start;
}

// Whether the fine fit found the modes of the coarse one. If not, the record breaks the assumptions
// of the fit: the base's motion is not even, or the noise is of another kind.
bool agrees(const Eigen::VectorXd& fine, const Eigen::VectorXd& coarse) {
  constexpr double kMain = 0.02;
  constexpr double kOther = 0.06;
  constexpr double kDamping = 0.7;
  for (Eigen::Index m = 0; m < modes_in(fine); ++m) {
    if (!(std::abs(fine[3 * m] - coarse[3 * m]) < (m == 0 ? kMain : kOther)) ||
        !(std::abs(fine[3 * m + 1] - coarse[3 * m + 1]) < kDamping)) {
      return false;
    }
  }
  return true;
}

// The curves in steps of 1 Hz.
Curve curve_of(const FineBand& band, const Eigen::ArrayXd& excitation, const Eigen::VectorXd& p) {
  const auto one_hz = static_cast<Eigen::Index>(1.0 / band.step_hz);
  const auto in_steps = [&](const Eigen::ArrayXd& values) {
    std::vector<double> means;
    for (Eigen::Index i = 0; i + one_hz <= values.size(); i += one_hz) {
      means.push_back(values.segment(i, one_hz).mean());
    }
    return means;
  };
  Curve curve{.x = in_steps(band.freq_hz),
              .measured = in_steps(band.energy),
              .fitted = in_steps(energy_of(band.freq_hz, excitation, p)),
              .modes = {},
              .noise = {}};
  for (Eigen::Index m = 0; m < modes_in(p); ++m) {
    curve.modes.push_back(in_steps(excitation * answer(band.freq_hz, p, m).abs2()));
  }
  curve.noise = in_steps(noise_of(band.freq_hz, p));
  return curve;
}

void fit_finely(const std::vector<double>& samples, double rate_hz, const Sweep& sweep,
                const Eigen::VectorXd& theta, RecordFit& record) {
  FineBand band = fine_band_of(energy_spectrum(samples, rate_hz), sweep);
  band.energy /= band.energy.mean();
  const Eigen::ArrayXd excitation = sweep_energy(band.freq_hz, sweep.start_hz);
  const FineFit fine = refine(band, excitation, start_of(band, excitation, theta));
  const Eigen::VectorXd& p = fine.fit.parameters;
  if (!agrees(p, theta)) {
    return;
  }
  // Deviations that are not noise go together over some tenths of a Hz.
  const auto block = static_cast<Eigen::Index>(0.5 / band.step_hz);
  record.model =
      model_of(Method::sweep, modes_of(p), of_gains(sandwich(fine.fit, fine.weights, block), p));
  record.curve = curve_of(band, excitation, p);
}

}  // namespace

bool holds_sweep(const std::vector<double>& samples, double rate_hz) {
  constexpr double kShortest_s = 10.0;
  return static_cast<double>(samples.size()) / rate_hz > kShortest_s;
}

Result<RecordFit> fit_sweep(const std::vector<double>& samples, double rate_hz,
                            const Sweep& sweep) {
  if (rate_hz < kSamplesPerPeriod * sweep.end_hz) {
    return fail(ErrorKind::input,
                fmt::format("{:.0f} samples a second do not show a sweep up to {:g} Hz; say with "
                            "--freq-end, at most {:.0f}, where the test ended",
                            rate_hz, sweep.end_hz, std::floor(rate_hz / kSamplesPerPeriod)));
  }
  const auto [least, most] = std::ranges::minmax(samples);
  if (!(least < most)) {
    return fail(ErrorKind::input, "there is no motion in the band of the sweep");
  }
  Result<ModesFit> coarse = fit_modes(welch_spectrum(samples, rate_hz), sweep);
  if (!coarse) {
    return tl::unexpected(coarse.error());
  }
  RecordFit record = std::move(coarse->record);
  record.model.method = Method::sweep;
  if (record.is_trusted() && !coarse->has_rivals) {
    fit_finely(samples, rate_hz, sweep, coarse->theta, record);
  }
  return record;
}

}  // namespace unflex::identify
