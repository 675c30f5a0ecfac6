#include "unflex/study/truth.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <unsupported/Eigen/NonLinearOptimization>
#include <unsupported/Eigen/NumericalDiff>
#include <unsupported/Eigen/Polynomials>

#include "unflex/core/math.hpp"

namespace unflex::study {
namespace {

using Complex = std::complex<double>;

constexpr double kFrom_hz = 15.0;
constexpr double kTo_hz = 128.0;
constexpr int kMostModes = 4;
constexpr double kMostOfAllGains = 1.7;

struct Bins {
  Eigen::ArrayXd freq_hz;
  Eigen::ArrayXd logarithm;  // of P/ν²
};

std::optional<Bins> bins_of(double step_hz, const std::vector<double>& density) {
  constexpr std::size_t kFewest = 25;
  const auto first = static_cast<std::size_t>(std::ceil(kFrom_hz / step_hz));
  const std::size_t end = std::min(static_cast<std::size_t>(kTo_hz / step_hz) + 1, density.size());
  if (end < first + kFewest) {
    return std::nullopt;
  }
  const auto count = static_cast<Eigen::Index>(end - first);
  Bins bins{Eigen::ArrayXd(count), Eigen::ArrayXd(count)};
  double sum = 0.0;
  for (std::size_t k = first; k < end; ++k) {
    sum += density[k];
  }
  for (std::size_t k = first; k < end; ++k) {
    const double freq_hz = static_cast<double>(k) * step_hz;
    const auto i = static_cast<Eigen::Index>(k - first);
    bins.freq_hz[i] = freq_hz;
    bins.logarithm[i] = math::log(std::max(density[k] / sum, 1e-12) / (freq_hz * freq_hz));
  }
  return sum > 0.0 ? std::optional(std::move(bins)) : std::nullopt;
}

// A value between two bounds from a number without any.
double within(double low, double high, double x) {
  return low + (high - low) * 0.5 * (1.0 + math::tanh(x));
}

double inside(double low, double high, double value) {
  const double share = std::clamp((value - low) / (high - low), 1e-3, 1.0 - 1e-3);
  return 0.5 * math::log(share / (1.0 - share));
}

constexpr double kLeast_hz = 17.0;
constexpr double kMost_hz = 150.0;
constexpr double kLeastDamping = 0.015;
constexpr double kMostDamping = 0.35;

double freq_of(const Eigen::VectorXd& p, int mode) {
  return math::exp(within(math::log(kLeast_hz), math::log(kMost_hz), p[3 * mode]));
}

double damping_of(const Eigen::VectorXd& p, int mode) {
  return math::exp(within(math::log(kLeastDamping), math::log(kMostDamping), p[3 * mode + 1]));
}

int modes_of(const Eigen::VectorXd& p) { return static_cast<int>(p.size() - 1) / 3; }

Eigen::ArrayXd logarithm_of(const Eigen::VectorXd& p, const Eigen::ArrayXd& freq_hz) {
  Eigen::ArrayXd result(freq_hz.size());
  const double noise = math::exp(p[p.size() - 1]);
  for (Eigen::Index k = 0; k < freq_hz.size(); ++k) {
    Complex sum = 0.0;
    for (int m = 0; m < modes_of(p); ++m) {
      const double r = freq_hz[k] / freq_of(p, m);
      const Complex loss(0.0, 2.0 * damping_of(p, m) * r);
      sum += p[3 * m + 2] * (1.0 + loss) / (1.0 - r * r + loss);
    }
    const double square = freq_hz[k] * freq_hz[k] / 3600.0;
    result[k] = math::log(std::norm(sum) + noise / square + 1e-14);
  }
  return result;
}

// The fit minimises the sum of squares of these: the soft L1 loss of each bin, a weak pull of
// amplitudes towards the order of 1, and a penalty for gains that nearly cancel.
struct Residuals {
  using Scalar = double;
  using InputType = Eigen::VectorXd;
  using ValueType = Eigen::VectorXd;
  using JacobianType = Eigen::MatrixXd;
  enum { InputsAtCompileTime = Eigen::Dynamic, ValuesAtCompileTime = Eigen::Dynamic };

  const Bins* bins;
  int unknowns;

  [[nodiscard]] int inputs() const { return unknowns; }
  [[nodiscard]] int values() const { return static_cast<int>(bins->freq_hz.size()) + unknowns + 1; }
  int operator()(const Eigen::VectorXd& p, Eigen::VectorXd& result) const {
    constexpr double kScale = 0.3;
    constexpr double kPull = 1e-2;
    constexpr double kCancelling = 1.0;
    const Eigen::ArrayXd off = (bins->logarithm - logarithm_of(p, bins->freq_hz)) / kScale;
    const Eigen::Index count = off.size();
    for (Eigen::Index k = 0; k < count; ++k) {
      const double loss = 2.0 * kScale * kScale * (std::sqrt(1.0 + off[k] * off[k]) - 1.0);
      result[k] = std::copysign(std::sqrt(loss), off[k]);
    }
    result.segment(count, unknowns) = kPull * p;
    double sum = 0.0;
    double all = 0.0;
    for (Eigen::Index i = 2; i < p.size() - 1; i += 3) {
      sum += p[i];
      all += std::abs(p[i]);
    }
    result[count + unknowns] = kCancelling * std::max(all / std::abs(sum) - kMostOfAllGains, 0.0);
    return 0;
  }
};

struct Fit {
  Eigen::VectorXd p;
  double cost = std::numeric_limits<double>::infinity();
};

Fit minimised(const Bins& bins, const Eigen::VectorXd& start) {
  constexpr int kMostCalls = 1500;
  Eigen::NumericalDiff<Residuals> residuals(Residuals{&bins, static_cast<int>(start.size())});
  Eigen::LevenbergMarquardt<Eigen::NumericalDiff<Residuals>> method(residuals);
  method.parameters.maxfev = kMostCalls;
  method.parameters.ftol = method.parameters.xtol = 1e-7;
  Fit fit{start, 0.0};
  method.minimize(fit.p);
  Eigen::VectorXd values(residuals.values());
  residuals(fit.p, values);
  fit.cost = values.squaredNorm();
  return fit.p.allFinite() && std::isfinite(fit.cost) ? fit : Fit{};
}

std::vector<double> peaks_of(const Bins& bins, const Eigen::ArrayXd& heights, std::size_t most) {
  std::vector<std::pair<double, double>> peaks;
  for (Eigen::Index k = 1; k + 1 < heights.size(); ++k) {
    if (heights[k] > heights[k - 1] && heights[k] >= heights[k + 1]) {
      peaks.emplace_back(heights[k], bins.freq_hz[k]);
    }
  }
  std::ranges::sort(peaks, std::greater{});
  std::vector<double> places;
  for (std::size_t i = 0; i < std::min(most, peaks.size()); ++i) {
    places.push_back(peaks[i].second);
  }
  return places;
}

Eigen::VectorXd with_mode(const Eigen::VectorXd& p, double freq_hz, double damping, double a) {
  const Eigen::Index count = p.size() - 1;
  Eigen::VectorXd result(p.size() + 3);
  result << p.head(count), inside(math::log(kLeast_hz), math::log(kMost_hz), math::log(freq_hz)),
      inside(math::log(kLeastDamping), math::log(kMostDamping), math::log(damping)), a, p.tail(1);
  return result;
}

// Scaled so that the logarithm is right on average.
Eigen::VectorXd scaled(Eigen::VectorXd p, const Bins& bins) {
  const double factor = math::exp(0.5 * (bins.logarithm - logarithm_of(p, bins.freq_hz)).mean());
  for (int m = 0; m < modes_of(p); ++m) {
    p[3 * m + 2] *= factor;
  }
  return p;
}

std::vector<dynamics::Mode> modes_from(const Eigen::VectorXd& p) {
  double sum = 0.0;
  for (int m = 0; m < modes_of(p); ++m) {
    sum += p[3 * m + 2];
  }
  std::vector<dynamics::Mode> modes;
  for (int m = 0; m < modes_of(p); ++m) {
    modes.push_back({2.0 * std::numbers::pi * freq_of(p, m), damping_of(p, m), p[3 * m + 2] / sum});
  }
  return modes;
}

// Whether the modes are those of a machine. Large gains that nearly cancel draw a shape, not a
// machine. So does a damping ratio on its bound, unless the mode lies beyond the band.
// In the lowest mode of a chain of masses all move the same way, as they do at rest.
bool is_machine(const std::vector<dynamics::Mode>& modes) {
  constexpr double kApart = 0.15;
  constexpr double kNear = 1.03;
  if (std::ranges::min(modes, {}, &dynamics::Mode::omega_rad_s).gain < 0.0) {
    return false;
  }
  double all = 0.0;
  for (const dynamics::Mode& mode : modes) {
    all += std::abs(mode.gain);
    if (mode.zeta > kMostDamping / kNear && mode.omega_rad_s < 2.0 * std::numbers::pi * kTo_hz) {
      return false;
    }
    for (const dynamics::Mode& other : modes) {
      if (mode.gain > 0.2 && other.gain < -0.2 &&
          std::abs(math::log(mode.omega_rad_s / other.omega_rad_s)) < kApart) {
        return false;
      }
    }
  }
  return all < kMostOfAllGains + 0.3;
}

// Fits with one mode more than those given, the best first; with one if none are given.
std::vector<Fit> extended(const Bins& bins, const std::vector<Fit>& fewer) {
  constexpr std::size_t kKept = 6;
  constexpr std::size_t kBases = 3;
  const Eigen::ArrayXd swing = bins.logarithm;
  const Eigen::ArrayXd accel = bins.logarithm + 2.0 * bins.freq_hz.unaryExpr(&math::log);
  std::vector<double> places = {25.0, 40.0, 60.0, 80.0, 100.0, 120.0, 140.0};
  for (const Eigen::ArrayXd& heights : {swing, accel}) {
    const std::vector<double> more = peaks_of(bins, heights, 3);
    places.insert(places.end(), more.begin(), more.end());
  }
  std::vector<Fit> fits;
  if (fewer.empty()) {
    const Eigen::VectorXd noise = Eigen::VectorXd::Constant(1, -9.0);
    for (const double freq_hz : places) {
      for (const double damping : {0.05, 0.15}) {
        fits.push_back(minimised(bins, scaled(with_mode(noise, freq_hz, damping, 0.02), bins)));
      }
    }
  }
  for (std::size_t i = 0; i < std::min(kBases, fewer.size()); ++i) {
    const Eigen::VectorXd& base = fewer[i].p;
    double sum = 0.0;
    for (int m = 0; m < modes_of(base); ++m) {
      sum += base[3 * m + 2];
    }
    for (const double freq_hz : places) {
      for (const double share : {0.2, -0.15}) {
        fits.push_back(minimised(bins, with_mode(base, freq_hz, 0.07, share * sum)));
      }
    }
  }
  std::ranges::stable_sort(
      fits, {}, [](const Fit& fit) { return std::pair(!is_machine(modes_from(fit.p)), fit.cost); });
  fits.resize(std::min(fits.size(), kKept));
  return fits;
}

Eigen::VectorXd product(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  Eigen::VectorXd result = Eigen::VectorXd::Zero(a.size() + b.size() - 1);
  for (Eigen::Index i = 0; i < a.size(); ++i) {
    result.segment(i, b.size()) += a[i] * b;
  }
  return result;
}

// Whether all zeros of H lie in the left half plane; s in units of 2π · 60 Hz.
bool is_minimum_phase(const std::vector<dynamics::Mode>& modes) {
  constexpr double kUnit_rad_s = 377.0;
  if (modes.size() < 2) {
    return true;
  }
  const auto part = [&](const dynamics::Mode& mode, bool is_denominator) -> Eigen::VectorXd {
    const double w = mode.omega_rad_s / kUnit_rad_s;
    return is_denominator ? Eigen::VectorXd(Eigen::Vector3d(w * w, 2.0 * mode.zeta * w, 1.0))
                          : Eigen::VectorXd(Eigen::Vector2d(w * w, 2.0 * mode.zeta * w));
  };
  Eigen::VectorXd numerator = Eigen::VectorXd::Zero(2 * static_cast<Eigen::Index>(modes.size()));
  for (std::size_t i = 0; i < modes.size(); ++i) {
    Eigen::VectorXd term = modes[i].gain * part(modes[i], false);
    for (std::size_t j = 0; j < modes.size(); ++j) {
      term = j == i ? term : product(term, part(modes[j], true));
    }
    numerator += term;
  }
  const Eigen::PolynomialSolver<double, Eigen::Dynamic> solver(numerator);
  return std::ranges::none_of(solver.roots(),
                              [](const Complex& zero) { return zero.real() > 0.0; });
}

}  // namespace

std::optional<std::vector<dynamics::Mode>> fitted_truth(double step_hz,
                                                        const std::vector<double>& density) {
  constexpr double kPhaseWorth = 6.0;
  const std::optional<Bins> bins = bins_of(step_hz, density);
  if (!bins) {
    return std::nullopt;
  }
  const auto count = static_cast<double>(bins->freq_hz.size());
  std::optional<std::vector<dynamics::Mode>> best;
  double least = std::numeric_limits<double>::infinity();
  std::vector<Fit> fits;
  for (int n = 1; n <= kMostModes; ++n) {
    fits = extended(*bins, fits);
    for (const Fit& fit : fits) {
      const std::vector<dynamics::Mode> modes = modes_from(fit.p);
      const double criterion = count * math::log(fit.cost / count) +
                               static_cast<double>(fit.p.size()) * math::log(count) +
                               (is_minimum_phase(modes) ? 0.0 : kPhaseWorth);
      if (is_machine(modes) && criterion < least) {
        least = criterion;
        best = modes;
      }
    }
  }
  return best;
}

}  // namespace unflex::study
