// A spectrum by Welch's method is the sweep's energy behind the mode, smeared by the energy of the
// window's own spectrum. We neglect that its windows weigh some moments more than others.
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "least_squares.hpp"
#include "response.hpp"
#include "unflex/identify/mode.hpp"
#include "welch_window.hpp"

namespace unflex::identify {
namespace {

constexpr double kLowest_hz = 12.0;

Eigen::ArrayXd kaiser_energy() {
  const Eigen::ArrayXd energy = kaiser_amplitude().array().square();
  return energy / energy.sum();
}

class WelchModel {
 public:
  WelchModel(const Spectrum& spectrum, Eigen::Index first, Eigen::Index count, double start_hz)
      : count_(count), kernel_(kaiser_energy()) {
    const Eigen::Index places = (count + 2 * kReachOfWindow) * kPartsOfBin;
    const double from_hz = (static_cast<double>(first) - kReachOfWindow) * spectrum.step_hz;
    fine_hz_ = Eigen::ArrayXd::LinSpaced(
        places, from_hz,
        from_hz + static_cast<double>(places - 1) / kPartsOfBin * spectrum.step_hz);
    excitation_ = sweep_energy(fine_hz_, start_hz);
    divisor_ = Eigen::ArrayXd::Ones(count);
    if (spectrum.is_normalized) {
      for (Eigen::Index i = 0; i < count; ++i) {
        divisor_[i] = static_cast<double>(first + i) * spectrum.step_hz + 0.1;
      }
    }
  }

  [[nodiscard]] Eigen::ArrayXd operator()(const SpectrumParameters& p) const {
    const Eigen::ArrayXd fine =
        p.scale * excitation_ * gain_squared(fine_hz_, p.mode_hz, p.damping_ratio);
    Eigen::ArrayXd bins(count_);
    for (Eigen::Index i = 0; i < count_; ++i) {
      bins[i] = (fine.segment(i * kPartsOfBin, kernel_.size()) * kernel_).sum() + p.noise;
    }
    return bins / divisor_;
  }

 private:
  Eigen::Index count_;
  Eigen::ArrayXd kernel_;
  Eigen::ArrayXd fine_hz_;
  Eigen::ArrayXd excitation_;
  Eigen::ArrayXd divisor_;
};

// The bins in the band of the sweep, relative to their mean.
struct Bins {
  Eigen::Index first = 0;
  Eigen::ArrayXd freq_hz;
  Eigen::ArrayXd density;
};

Result<Bins> bins_of(const Spectrum& spectrum, Axis axis, const Sweep& sweep) {
  constexpr Eigen::Index kFewest = 20;
  const std::vector<double>& density = spectrum.density[axis == Axis::x ? 0 : 1];
  const auto first = static_cast<Eigen::Index>(
      std::ceil(std::max(kLowest_hz, 1.2 * sweep.start_hz) / spectrum.step_hz));
  const auto last = std::min(static_cast<Eigen::Index>(sweep.end_hz / spectrum.step_hz) - 1,
                             static_cast<Eigen::Index>(density.size()));
  if (last - first < kFewest) {
    return fail(ErrorKind::input, "it has too few frequencies in the band of the sweep");
  }
  Bins bins{.first = first,
            .freq_hz = Eigen::ArrayXd::LinSpaced(last - first,
                                                 static_cast<double>(first) * spectrum.step_hz,
                                                 static_cast<double>(last - 1) * spectrum.step_hz),
            .density = Eigen::Map<const Eigen::ArrayXd>(density.data() + first, last - first)};
  if (!(bins.density.maxCoeff() > 0.0)) {
    return fail(ErrorKind::input, "there is no motion in the band of the sweep");
  }
  bins.density /= bins.density.mean();
  return bins;
}

struct Candidate {
  LeastSquares fit;
  Eigen::ArrayXd weights;
  double cost = 0.0;
};

// The error of a bin is proportional to its height, but no smaller than a hundredth of the root
// mean square.
Candidate refine(const Bins& bins, const WelchModel& welch, SpectrumParameters start) {
  constexpr int kRounds = 6;
  constexpr double kLeastVariance = 1e-4;
  const Model model = [&](const Eigen::VectorXd& p) { return welch(SpectrumParameters::from(p)); };
  Candidate candidate;
  Eigen::VectorXd at = start.logarithms();
  for (int round = 0; round < kRounds; ++round) {
    candidate.weights =
        (model(at).square() + kLeastVariance * bins.density.square().mean()).inverse();
    candidate.fit = minimise(model, bins.density, candidate.weights, at);
    at = candidate.fit.parameters;
  }
  candidate.cost = candidate.fit.weighted_sum - candidate.weights.log().sum();
  return candidate;
}

Candidate best_of(const Bins& bins, const WelchModel& welch) {
  Eigen::Index peak = 0;
  (bins.density / bins.freq_hz).maxCoeff(&peak);
  Candidate best;
  for (const double damping_ratio : {0.03, 0.1, 0.25}) {
    SpectrumParameters start{bins.freq_hz[peak], damping_ratio, 1.0, 1e-6};
    start.scale = 1.0 / welch(start).mean();
    start.noise = 1e-3;
    Candidate candidate = refine(bins, welch, start);
    if (best.weights.size() == 0 || candidate.cost < best.cost) {
      best = std::move(candidate);
    }
  }
  return best;
}

// Variances of the parameters: the greater of what the residual's size tells and what its pattern
// tells, since the window makes neighbours alike. They are doubled, because a resonance has only a
// few bins.
Eigen::VectorXd variances(const Candidate& candidate) {
  constexpr double kCaution = 2.0;
  const LeastSquares& fit = candidate.fit;
  const Eigen::Index unknowns = fit.parameters.size();
  const double spread = fit.weighted_sum / static_cast<double>(fit.residual.size() - unknowns);
  const Eigen::MatrixXd even =
      spread * (fit.jacobian.transpose() * candidate.weights.matrix().asDiagonal() * fit.jacobian)
                   .ldlt()
                   .solve(Eigen::MatrixXd::Identity(unknowns, unknowns));
  const Eigen::MatrixXd together = sandwich(fit, candidate.weights, kReachOfWindow);
  return kCaution * even.diagonal().cwiseMax(together.diagonal());
}

}  // namespace

Result<Mode> fit_spectrum(const Spectrum& spectrum, Axis axis, const Sweep& sweep) {
  const Result<Bins> bins = bins_of(spectrum, axis, sweep);
  if (!bins) {
    return tl::unexpected(bins.error());
  }
  const WelchModel welch(spectrum, bins->first, bins->density.size(), sweep.start_hz);
  const Candidate best = best_of(*bins, welch);
  const SpectrumParameters p = SpectrumParameters::from(best.fit.parameters);
  const Eigen::VectorXd variance = variances(best);
  Mode mode;
  mode.method = Method::spectrum;
  mode.freq_hz = estimate_of(p.mode_hz, variance[0]);
  mode.damping_ratio = estimate_of(p.damping_ratio, variance[1]);
  const Eigen::ArrayXd fitted = bins->density - best.fit.residual;
  add_warnings(misfit_of(bins->freq_hz, bins->density, fitted, fitted.minCoeff(), 3), sweep, mode);
  mode.curve.x.assign(bins->freq_hz.begin(), bins->freq_hz.end());
  mode.curve.measured.assign(bins->density.begin(), bins->density.end());
  mode.curve.fitted.assign(fitted.begin(), fitted.end());
  return mode;
}

}  // namespace unflex::identify
