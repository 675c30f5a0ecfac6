// A spectrum by Welch's method is, but for which moments its windows weigh the more, the sweep's
// energy behind the mode, smeared by the window's own spectrum. Klipper's window is Kaiser's with
// β = 6, whose energy at x bins from the centre is (Kaiser and Schafer, On the Use of the I0-sinh
// Window for Spectrum Analysis, 1980)
//   ( sinh √(β² − π²x²) / √(β² − π²x²) )².
#include <algorithm>
#include <cmath>
#include <numbers>

#include "least_squares.hpp"
#include "response.hpp"
#include "unflex/identify/mode.hpp"

namespace unflex::identify {
namespace {

constexpr int kParts = 8;  // places per bin
constexpr int kReach = 4;  // bins to either side
constexpr double kLowest_hz = 12.0;

Eigen::ArrayXd kaiser_energy() {
  constexpr double kBeta = 6.0;
  Eigen::ArrayXd energy(2 * kParts * kReach + 1);
  for (Eigen::Index i = 0; i < energy.size(); ++i) {
    const double x = static_cast<double>(i) / kParts - kReach;
    const double square = kBeta * kBeta - std::numbers::pi * std::numbers::pi * x * x;
    const double root = std::sqrt(std::abs(square));
    const double value =
        root < 1e-9 ? 1.0 : (square > 0.0 ? std::sinh(root) : std::sin(root)) / root;
    energy[i] = value * value;
  }
  return energy / energy.sum();
}

class WelchModel {
 public:
  WelchModel(const Spectrum& spectrum, Eigen::Index first, Eigen::Index count, double start_hz)
      : count_(count), kernel_(kaiser_energy()) {
    const Eigen::Index places = (count + 2 * kReach) * kParts;
    const double from_hz = (static_cast<double>(first) - kReach) * spectrum.step_hz;
    fine_hz_ = Eigen::ArrayXd::LinSpaced(
        places, from_hz, from_hz + static_cast<double>(places - 1) / kParts * spectrum.step_hz);
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
      bins[i] = (fine.segment(i * kParts, kernel_.size()) * kernel_).sum() + p.noise;
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

}  // namespace

Result<Mode> fit_spectrum(const Spectrum& spectrum, Axis axis, const Sweep& sweep) {
  const std::vector<double>& density = spectrum.density[axis == Axis::x ? 0 : 1];
  const auto first = static_cast<Eigen::Index>(
      std::ceil(std::max(kLowest_hz, 1.2 * sweep.start_hz) / spectrum.step_hz));
  const auto last = std::min(static_cast<Eigen::Index>(sweep.end_hz / spectrum.step_hz) - 1,
                             static_cast<Eigen::Index>(density.size()));
  constexpr Eigen::Index kFewest = 20;
  if (last - first < kFewest) {
    return fail(ErrorKind::input, "it has too few frequencies in the band of the sweep");
  }
  Eigen::ArrayXd data = Eigen::Map<const Eigen::ArrayXd>(density.data() + first, last - first);
  if (!(data.maxCoeff() > 0.0)) {
    return fail(ErrorKind::input, "there is no motion in the band of the sweep");
  }
  data /= data.mean();
  const Eigen::ArrayXd freq_hz =
      Eigen::ArrayXd::LinSpaced(data.size(), static_cast<double>(first) * spectrum.step_hz,
                                static_cast<double>(last - 1) * spectrum.step_hz);
  const WelchModel welch(spectrum, first, data.size(), sweep.start_hz);
  const Model model = [&](const Eigen::VectorXd& p) { return welch(SpectrumParameters::from(p)); };

  Eigen::Index peak = 0;
  (data / freq_hz).maxCoeff(&peak);
  LeastSquares best;
  Eigen::ArrayXd best_weights;
  double best_cost = 0.0;
  for (const double damping_ratio : {0.03, 0.1, 0.25}) {
    SpectrumParameters p{freq_hz[peak], damping_ratio, 1.0, 1e-6};
    p.scale = data.mean() / welch(p).mean();
    p.noise = 1e-3 * data.mean();
    Eigen::VectorXd at = p.logarithms();
    LeastSquares fit;
    Eigen::ArrayXd weights;
    // How far a bin is off goes with its height; nothing is better known than to a hundredth of
    // the mean.
    for (int round = 0; round < 6; ++round) {
      weights = (model(at).square() + 1e-4 * data.square().mean()).inverse();
      fit = minimise(model, data, weights, at);
      at = fit.parameters;
    }
    const double cost = fit.weighted_sum - weights.log().sum();
    if (best_weights.size() == 0 || cost < best_cost) {
      best = std::move(fit);
      best_weights = weights;
      best_cost = cost;
    }
  }
  const SpectrumParameters p = SpectrumParameters::from(best.parameters);
  const double spread = best.weighted_sum / static_cast<double>(data.size() - 4);
  const Eigen::MatrixXd even =
      spread * (best.jacobian.transpose() * best_weights.matrix().asDiagonal() * best.jacobian)
                   .ldlt()
                   .solve(Eigen::MatrixXd::Identity(4, 4));
  // The window makes neighbours alike.
  const Eigen::MatrixXd together = sandwich(best, best_weights, kReach);
  Mode mode;
  mode.method = Method::spectrum;
  mode.freq_hz = estimate_of(p.mode_hz, 2.0 * std::max(even(0, 0), together(0, 0)));
  mode.damping_ratio = estimate_of(p.damping_ratio, 2.0 * std::max(even(1, 1), together(1, 1)));
  const Eigen::ArrayXd fitted = data - best.residual;
  add_warnings(misfit_of(freq_hz, data, fitted, fitted.minCoeff(), 3), sweep, mode);
  mode.curve.x.assign(freq_hz.begin(), freq_hz.end());
  mode.curve.measured.assign(data.begin(), data.end());
  mode.curve.fitted.assign(fitted.begin(), fitted.end());
  return mode;
}

}  // namespace unflex::identify
