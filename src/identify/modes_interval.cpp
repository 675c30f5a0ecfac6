// Notation: J derivatives of the log density, W weights of the robust loss, Λ precision of the
// prior, R correlation of neighbouring bins, σ² variance of the residual. The covariance is
//   σ² A Jᵀ W R W J A + σ² A Λ A,   A = (Jᵀ W J + Λ)⁻¹.
#include "modes_interval.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "modes_search.hpp"
#include "response.hpp"
#include "unflex/core/math.hpp"

namespace unflex::identify {
namespace {

constexpr double kStep = 1e-4;  // of differences, in standard deviations

Eigen::MatrixXd correlations(const ModesModel& model, Eigen::Index bins) {
  Eigen::MatrixXd result(bins, bins);
  for (Eigen::Index i = 0; i < bins; ++i) {
    for (Eigen::Index j = 0; j < bins; ++j) {
      result(i, j) = model.correlation(std::abs(i - j));
    }
  }
  return result;
}

// Covariance of θ.
Eigen::MatrixXd covariance_of(const ModesModel& model, const Band& band, const Prior& prior,
                              const Eigen::VectorXd& theta) {
  constexpr double kCaution = 1.8;
  Eigen::ArrayXd values;
  Eigen::MatrixXd jacobian;
  model(theta, values, &jacobian);
  const Eigen::ArrayXd residual = band.logarithms() - values;
  const Eigen::ArrayXd weights = ((residual / kLossScale).square() + 1.0).sqrt().inverse();
  const Eigen::Index bins = residual.size();
  const Eigen::Index unknowns = theta.size();
  const Eigen::MatrixXd weighted = weights.matrix().asDiagonal() * jacobian;
  Eigen::MatrixXd normal = jacobian.transpose() * weighted;
  normal.diagonal() += prior.precision;
  const Eigen::MatrixXd inverse =
      normal.ldlt().solve(Eigen::MatrixXd::Identity(unknowns, unknowns));
  const Eigen::MatrixXd together = correlations(model, bins);
  const Eigen::MatrixXd filling = weighted.transpose() * together * weighted;
  // The fit takes up part of the scatter.
  const double taken = (inverse * filling).trace();
  const double free = std::max(static_cast<double>(bins) - taken, 0.2 * static_cast<double>(bins));
  const double variance = (weights * residual.square()).sum() / weights.mean() / free;
  Eigen::MatrixXd middle = filling;
  middle.diagonal() += prior.precision;
  return kCaution * variance * inverse * middle * inverse;
}

std::vector<ModeOfAxis> moved(const std::vector<ModeOfAxis>& modes, const Eigen::VectorXd& by) {
  std::vector<ModeOfAxis> result = modes;
  double sum = 0.0;
  for (std::size_t m = 0; m < modes.size(); ++m) {
    const auto at = 3 * static_cast<Eigen::Index>(m);
    result[m].freq_hz *= math::exp(by[at]);
    result[m].damping_ratio = std::clamp(modes[m].damping_ratio * math::exp(by[at + 1]),
                                         0.5 * kLeastDamping, 1.5 * kMostDamping);
    result[m].gain += by[at + 2];
    sum += result[m].gain;
  }
  for (ModeOfAxis& mode : result) {
    mode.gain /= sum;
  }
  return result;
}

// A matrix R with R Rᵀ the covariance.
Eigen::MatrixXd root_of(const Eigen::MatrixXd& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> parts(covariance);
  return parts.eigenvectors() * parts.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal();
}

// Shortens a step so far that H changes about evenly with (log f, log ζ, g) along it.
Eigen::VectorXd shortened(const Eigen::VectorXd& step) {
  constexpr double kFreq = 0.1;
  constexpr double kDamping = 0.7;
  constexpr double kGain = 0.3;
  double share = 1.0;
  for (Eigen::Index i = 0; i < step.size(); ++i) {
    const double most = i % 3 == 0 ? kFreq : i % 3 == 1 ? kDamping : kGain;
    share = std::min(share, most / std::max(std::abs(step[i]), most));
  }
  return share * step;
}

// The fit, and points to either side along the two directions of the covariance that change H the
// most, per frequency: √3 standard deviations away with a sixth of the weight each, which gives
// mean and variance along them (Julier and Uhlmann, Unscented Filtering and Nonlinear Estimation,
// 2004).
std::vector<Plant> plants_of(const Eigen::ArrayXd& freq_hz, const std::vector<ModeOfAxis>& modes,
                             const Eigen::MatrixXd& covariance) {
  constexpr Eigen::Index kDirections = 2;
  const Eigen::Index count = covariance.rows();
  const Eigen::MatrixXd root = root_of(covariance);
  const Eigen::ArrayXcd middle = response_of(freq_hz, modes);
  Eigen::MatrixXd change(2 * freq_hz.size(), count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::ArrayXcd by =
        (response_of(freq_hz, moved(modes, kStep * root.col(i))) - middle) / kStep / freq_hz;
    change.col(i) << by.real().matrix(), by.imag().matrix();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> swings(change.transpose() * change);
  std::vector<Plant> plants = {{.modes = modes, .share = 1.0 - kDirections / 3.0}};
  for (Eigen::Index i = 0; i < kDirections; ++i) {
    const Eigen::VectorXd along =
        shortened(std::sqrt(3.0) * (root * swings.eigenvectors().col(count - 1 - i)));
    plants.push_back({.modes = moved(modes, along), .share = 1.0 / 6.0});
    plants.push_back({.modes = moved(modes, -along), .share = 1.0 / 6.0});
  }
  return plants;
}

// Where H is compared.
Eigen::ArrayXd places_hz() { return Eigen::ArrayXd::LinSpaced(120, 12.0, 131.0); }

}  // namespace

Eigen::MatrixXd of_gains(const Eigen::MatrixXd& covariance, const Eigen::VectorXd& theta) {
  const std::vector<ModeOfAxis> modes = modes_of(theta);
  const auto count = 3 * static_cast<Eigen::Index>(modes.size());
  double sum = 0.0;
  for (Eigen::Index i = 2; i < count; i += 3) {
    sum += theta[i];
  }
  Eigen::MatrixXd map = Eigen::MatrixXd::Identity(count, count);
  for (Eigen::Index i = 2; i < count; i += 3) {
    for (Eigen::Index j = 2; j < count; j += 3) {
      map(i, j) = ((i == j ? 1.0 : 0.0) - modes[static_cast<std::size_t>(i / 3)].gain) / sum;
    }
  }
  return map * covariance.topLeftCorner(count, count) * map.transpose();
}

Eigen::MatrixXd covariance_of_modes(const ModesModel& model, const Band& band, const Prior& prior,
                                    const Eigen::VectorXd& theta) {
  return of_gains(covariance_of(model, band, prior, theta), theta);
}

Eigen::ArrayXcd response_of(const Eigen::ArrayXd& freq_hz, const std::vector<ModeOfAxis>& modes) {
  Eigen::ArrayXcd sum = Eigen::ArrayXcd::Zero(freq_hz.size());
  for (const ModeOfAxis& mode : modes) {
    sum += mode.gain * mode_response(freq_hz, mode.freq_hz, mode.damping_ratio);
  }
  return sum;
}

double distance(const std::vector<ModeOfAxis>& a, const std::vector<ModeOfAxis>& b) {
  const Eigen::ArrayXd places = places_hz();
  return ((response_of(places, a) - response_of(places, b)) / places).matrix().norm();
}

double swing(const std::vector<ModeOfAxis>& modes) {
  const Eigen::ArrayXd places = places_hz();
  return ((response_of(places, modes) - 1.0) / places).matrix().norm();
}

double spread_of_response(double freq_hz, const std::vector<ModeOfAxis>& modes,
                          const Eigen::MatrixXd& covariance) {
  const Eigen::ArrayXd place = Eigen::ArrayXd::Constant(1, freq_hz);
  const std::complex<double> middle = response_of(place, modes)[0];
  const Eigen::MatrixXd root = root_of(covariance);
  double variance = 0.0;
  for (Eigen::Index i = 0; i < root.cols(); ++i) {
    const std::complex<double> by =
        (response_of(place, moved(modes, kStep * root.col(i)))[0] - middle) / kStep;
    variance += math::square((by / middle).real());
  }
  return std::sqrt(variance);
}

AxisModel model_of(Method method, const std::vector<ModeOfAxis>& modes,
                   const Eigen::MatrixXd& covariance) {
  AxisModel model;
  model.method = method;
  for (std::size_t m = 0; m < modes.size(); ++m) {
    const ModeOfAxis& mode = modes[m];
    const auto at = 3 * static_cast<Eigen::Index>(m);
    const double gain_spread = kQuantile * std::sqrt(std::max(covariance(at + 2, at + 2), 0.0));
    model.modes.push_back(
        {.freq_hz = estimate_of(mode.freq_hz, covariance(at, at)),
         .damping_ratio = estimate_of(mode.damping_ratio, covariance(at + 1, at + 1)),
         .gain = {
             .value = mode.gain, .low = mode.gain - gain_spread, .high = mode.gain + gain_spread}});
  }
  for (Eigen::Index i = 0; i < covariance.rows(); ++i) {
    const Eigen::VectorXd row = covariance.row(i);
    model.covariance.insert(model.covariance.end(), row.begin(), row.end());
  }
  model.plants = plants_of(places_hz(), modes, covariance);
  return model;
}

}  // namespace unflex::identify
