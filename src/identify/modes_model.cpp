#include "modes_model.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "response.hpp"
#include "unflex/core/math.hpp"
#include "unflex/dynamics/flexible_axis.hpp"
#include "welch_window.hpp"

namespace unflex::identify {
namespace {

using Complex = std::complex<double>;

}  // namespace

Eigen::ArrayXd noise_rise(const Eigen::ArrayXd& freq_hz) {
  constexpr double kCorner_hz = 30.0;
  return (kCorner_hz / freq_hz).square();
}

ModesModel::ModesModel(const Band& band, double start_hz)
    : freq_hz_(band.freq_hz), floor_(band.floor) {
  const Eigen::VectorXd amplitude = kaiser_amplitude();
  const double energy = amplitude.squaredNorm();
  kernel_ = amplitude.cwiseAbs2() / energy;
  for (Eigen::Index k = 0; k < kReachOfWindow; ++k) {
    const Eigen::Index shift = k * kPartsOfBin;
    const Eigen::Index both = amplitude.size() - shift;
    const double common = amplitude.head(both).dot(amplitude.tail(both)) / energy;
    correlation_.push_back(common * common);
  }
  const Eigen::Index places = (freq_hz_.size() + 2 * kReachOfWindow) * kPartsOfBin;
  const double from_hz = (static_cast<double>(band.first) - kReachOfWindow) * band.step_hz;
  fine_hz_ =
      Eigen::ArrayXd::LinSpaced(
          places, from_hz, from_hz + static_cast<double>(places - 1) / kPartsOfBin * band.step_hz)
          .max(0.0);
  excitation_ = sweep_energy(fine_hz_, start_hz);
  excitation_ /= excitation_.mean();
  noise_shape_ = noise_rise(freq_hz_);
}

double ModesModel::correlation(Eigen::Index apart) const {
  return apart < kReachOfWindow ? correlation_[static_cast<std::size_t>(apart)] : 0.0;
}

double ModesModel::independent_bins() const {
  double together = 1.0;
  for (Eigen::Index k = 1; k < kReachOfWindow; ++k) {
    together += 2.0 * correlation(k);
  }
  return static_cast<double>(freq_hz_.size()) / together;
}

Eigen::ArrayXcd mode_response(const Eigen::ArrayXd& freq_hz, double mode_hz, double damping_ratio) {
  const Eigen::ArrayXd r = freq_hz / mode_hz;
  Eigen::ArrayXcd result(r.size());
  for (Eigen::Index i = 0; i < r.size(); ++i) {
    const Complex loss(0.0, 2.0 * damping_ratio * r[i]);
    result[i] = (1.0 + loss) / (1.0 - r[i] * r[i] + loss);
  }
  return result;
}

// With r = ν/f and D = 1 − r² + 2iζr, ∂h/∂log f = −(2r² + 2iζr³)/D² and ∂h/∂log ζ = −2iζr³/D².
void ModesModel::operator()(const Eigen::VectorXd& theta, Eigen::ArrayXd& values,
                            Eigen::MatrixXd* jacobian) const {
  const Eigen::Index modes = modes_in(theta);
  const Eigen::Index places = fine_hz_.size();
  const Eigen::Index bins = freq_hz_.size();
  const Eigen::Index columns = jacobian != nullptr ? 3 * modes + 1 : 1;
  Eigen::ArrayXcd whole = Eigen::ArrayXcd::Zero(places);
  Eigen::ArrayXXcd parts(places, jacobian != nullptr ? 3 * modes : 0);
  for (Eigen::Index m = 0; m < modes; ++m) {
    const double mode_hz = math::exp(theta[3 * m]);
    const double damping_ratio = math::exp(theta[3 * m + 1]);
    const double a = theta[3 * m + 2];
    for (Eigen::Index i = 0; i < places; ++i) {
      const double r = fine_hz_[i] / mode_hz;
      const double zr = damping_ratio * r;
      const double real = 1.0 - r * r;
      const double size = real * real + 4.0 * zr * zr;
      const Complex inverse(real / size, -2.0 * zr / size);
      const Complex response =
          inverse + Complex(-2.0 * zr * inverse.imag(), 2.0 * zr * inverse.real());
      whole[i] += a * response;
      if (jacobian != nullptr) {
        const Complex square(inverse.real() * inverse.real() - inverse.imag() * inverse.imag(),
                             2.0 * inverse.real() * inverse.imag());
        const double q = 2.0 * zr * r * r * a;
        const Complex by_damping(q * square.imag(), -q * square.real());
        parts(i, 3 * m) = by_damping - 2.0 * r * r * a * square;
        parts(i, 3 * m + 1) = by_damping;
        parts(i, 3 * m + 2) = response;
      }
    }
  }
  Eigen::MatrixXd fine(places, columns);
  fine.col(0) = (excitation_ * whole.abs2()).matrix();
  for (Eigen::Index c = 1; c < columns; ++c) {
    fine.col(c) =
        (2.0 * excitation_ *
         (whole.real() * parts.col(c - 1).real() + whole.imag() * parts.col(c - 1).imag()))
            .matrix();
  }
  Eigen::MatrixXd smeared(bins, columns);
  for (Eigen::Index c = 0; c < columns; ++c) {
    for (Eigen::Index i = 0; i < bins; ++i) {
      smeared(i, c) = kernel_.dot(fine.col(c).segment(i * kPartsOfBin, kernel_.size()));
    }
  }
  const double white = math::exp(theta[3 * modes]);
  const double rise = math::exp(theta[3 * modes + 1]);
  const Eigen::ArrayXd density = smeared.col(0).array() + white + rise * noise_shape_ + floor_;
  values = density.unaryExpr(&math::log);
  if (jacobian != nullptr) {
    jacobian->resize(bins, theta.size());
    jacobian->leftCols(3 * modes) =
        density.inverse().matrix().asDiagonal() * smeared.rightCols(3 * modes);
    jacobian->col(3 * modes) = (white / density).matrix();
    jacobian->col(3 * modes + 1) = (rise * noise_shape_ / density).matrix();
  }
}

Eigen::ArrayXd ModesModel::density(const Eigen::VectorXd& theta) const {
  Eigen::ArrayXd values;
  (*this)(theta, values, nullptr);
  return (values.unaryExpr(&math::exp) - floor_).max(0.0);
}

Eigen::ArrayXd ModesModel::mode_density(const Eigen::VectorXd& theta, Eigen::Index mode) const {
  constexpr double kNone = -60.0;
  Eigen::VectorXd alone(5);
  alone << theta.segment(3 * mode, 3), kNone, kNone;
  return density(alone);
}

Eigen::ArrayXd ModesModel::noise_density(const Eigen::VectorXd& theta) const {
  return math::exp(theta[theta.size() - 2]) + math::exp(theta[theta.size() - 1]) * noise_shape_;
}

std::vector<ModeOfAxis> modes_of(const Eigen::VectorXd& theta) {
  return modes_of_logarithms(theta.head(3 * modes_in(theta)));
}

std::vector<ModeOfAxis> modes_of_logarithms(const Eigen::VectorXd& parameters) {
  double sum = 0.0;
  for (Eigen::Index i = 2; i < parameters.size(); i += 3) {
    sum += parameters[i];
  }
  std::vector<ModeOfAxis> modes;
  for (Eigen::Index i = 0; i < parameters.size(); i += 3) {
    modes.push_back({.freq_hz = math::exp(parameters[i]),
                     .damping_ratio = math::exp(parameters[i + 1]),
                     .gain = parameters[i + 2] / sum});
  }
  return modes;
}

std::vector<Complex> zeros_of(const std::vector<ModeOfAxis>& modes) {
  std::vector<dynamics::Mode> list;
  for (const ModeOfAxis& mode : modes) {
    list.push_back({2.0 * std::numbers::pi * mode.freq_hz, mode.damping_ratio, mode.gain});
  }
  return dynamics::FlexibleAxis(list).zeros();
}

bool is_minimum_phase(const std::vector<ModeOfAxis>& modes) {
  return std::ranges::none_of(zeros_of(modes), [](const Complex& z) { return z.real() > 0.0; });
}

Eigen::VectorXd mirrored(const Eigen::VectorXd& theta, const Eigen::ArrayXd& freq_hz) {
  const std::vector<ModeOfAxis> modes = modes_of(theta);
  const Eigen::Index places = freq_hz.size();
  Eigen::ArrayXcd aim = Eigen::ArrayXcd::Zero(places);
  Eigen::MatrixXcd basis(places, modes_in(theta));
  for (Eigen::Index m = 0; m < modes_in(theta); ++m) {
    const ModeOfAxis& mode = modes[static_cast<std::size_t>(m)];
    basis.col(m) = mode_response(freq_hz, mode.freq_hz, mode.damping_ratio).matrix();
    aim += theta[3 * m + 2] * basis.col(m).array();
  }
  for (const Complex& zero : zeros_of(modes)) {
    if (zero.real() > 0.0) {
      for (Eigen::Index i = 0; i < places; ++i) {
        const Complex s(0.0, 2.0 * std::numbers::pi * freq_hz[i]);
        // The factor is 1 at s = 0 for a pair, and −1 for a real zero, which turns all signs.
        aim[i] *= (s + std::conj(zero)) / (s - zero);
      }
    }
  }
  Eigen::MatrixXd stacked(2 * places, basis.cols());
  stacked << basis.real(), basis.imag();
  Eigen::VectorXd wanted(2 * places);
  wanted << aim.real().matrix(), aim.imag().matrix();
  const Eigen::VectorXd a = stacked.colPivHouseholderQr().solve(wanted);
  Eigen::VectorXd result = theta;
  for (Eigen::Index m = 0; m < modes_in(theta); ++m) {
    result[3 * m + 2] = a[m];
  }
  return result;
}

}  // namespace unflex::identify
