// Notation:
//   ω, ζ, g   natural frequency, damping ratio and gain of a mode     b, q   base, the mode's part
//   ω_d    ω√(1−ζ²), damped frequency (ζ < 1)            κ      ω√(ζ²−1)      (ζ > 1)
//   y      q minus its steady response to the base: the free motion ÿ + 2ζωẏ + ω²y = 0
//
// The closed form is the textbook solution of the damped oscillator, e.g. Inman, Engineering
// Vibration, 4th ed., eq. 1.36 to 1.46.
#include "unflex/dynamics/flexible_axis.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "unflex/core/math.hpp"

namespace unflex::dynamics {
namespace {

double acceleration(const Mode& mode, const NozzleMotion& part, const NozzleMotion& base) {
  const double omega = mode.omega_rad_s;
  return 2.0 * mode.zeta * omega * (mode.gain * base.velocity - part.velocity) +
         omega * omega * (mode.gain * base.position - part.position + mode.lead_s * base.velocity);
}

NozzleMotion base_at(const BaseSegment& base, double t) {
  return {base.position + t * (base.velocity + 0.5 * base.acceleration * t),
          base.velocity + base.acceleration * t};
}

// Free motion over h seconds is spanned by c = e^{−ζωh} cos(ω_d h) and s = e^{−ζωh} sin(ω_d h)/ω_d.
struct FreeResponse {
  double c = 1.0;
  double s = 0.0;
};

FreeResponse underdamped(double omega, double zeta, double h) {
  const double damped = omega * std::sqrt((1.0 - zeta) * (1.0 + zeta));
  const double decay = math::exp(-zeta * omega * h);
  const double phase = damped * h;
  return {decay * math::cos(phase), decay * (phase > 0.0 ? math::sin(phase) / damped : h)};
}

// With κ for ω_d the circular functions become hyperbolic ones. These would overflow for large κh,
// so we write both with the two decaying exponentials. The slow rate ζω − κ comes from its
// conjugate.
FreeResponse overdamped(double omega, double zeta, double h) {
  const double root = std::sqrt((zeta - 1.0) * (zeta + 1.0));
  const double slow = math::exp(-omega / (zeta + root) * h);
  const double two_kappa_h = 2.0 * omega * root * h;
  const double fast_part = -math::expm1(-two_kappa_h);  // 1 − e^{−2κh}
  return {slow * (1.0 - 0.5 * fast_part),
          slow * h * (two_kappa_h > 0.0 ? fast_part / two_kappa_h : 1.0)};
}

// Coefficients from the constant on.
Eigen::VectorXd product(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  Eigen::VectorXd result = Eigen::VectorXd::Zero(a.size() + b.size() - 1);
  for (Eigen::Index i = 0; i < a.size(); ++i) {
    result.segment(i, b.size()) += a[i] * b;
  }
  return result;
}

NozzleMotion rk4_part(const Mode& mode, NozzleMotion part, const BaseSegment& base, double h) {
  // moved(): the start moved along `slope` over dt. slope_at(): the slope of (q, q̇) at `at`.
  const auto moved = [&](const NozzleMotion& slope, double dt) {
    return NozzleMotion{part.position + dt * slope.position, part.velocity + dt * slope.velocity};
  };
  const auto slope_at = [&](const NozzleMotion& at, const NozzleMotion& base_then) {
    return NozzleMotion{at.velocity, acceleration(mode, at, base_then)};
  };
  const NozzleMotion base_middle = base_at(base, 0.5 * h);
  const NozzleMotion k1 = slope_at(part, base_at(base, 0.0));
  const NozzleMotion k2 = slope_at(moved(k1, 0.5 * h), base_middle);
  const NozzleMotion k3 = slope_at(moved(k2, 0.5 * h), base_middle);
  const NozzleMotion k4 = slope_at(moved(k3, h), base_at(base, h));
  return {
      part.position + h / 6.0 * (k1.position + 2.0 * (k2.position + k3.position) + k4.position),
      part.velocity + h / 6.0 * (k1.velocity + 2.0 * (k2.velocity + k3.velocity) + k4.velocity)};
}

NozzleMotion exact_part(const Mode& mode, NozzleMotion part, const BaseSegment& base, double h) {
  const double omega = mode.omega_rad_s;
  const double zeta = mode.zeta;
  // Under constant acceleration of the base the nozzle settles a/ω² behind it, and with a lead τ
  // 2ζτa/ω more.
  const double lead = mode.lead_s;
  const double lag = mode.gain * (base.acceleration / (omega * omega)) +
                     2.0 * zeta * lead / omega * base.acceleration;
  const double y0 = part.position - mode.gain * base.position - lead * base.velocity + lag;
  const double yd0 = part.velocity - mode.gain * base.velocity - lead * base.acceleration;

  const FreeResponse free = zeta < 1.0 ? underdamped(omega, zeta, h) : overdamped(omega, zeta, h);
  const double y = free.c * y0 + free.s * (zeta * omega * y0 + yd0);
  const double yd = free.c * yd0 - free.s * (zeta * omega * yd0 + omega * omega * y0);

  const NozzleMotion base_end = base_at(base, h);
  return {mode.gain * base_end.position + lead * base_end.velocity - lag + y,
          mode.gain * base_end.velocity + lead * base.acceleration + yd};
}

}  // namespace

FlexibleAxis::FlexibleAxis(std::span<const Mode> modes) : count_(modes.size()) {
  std::ranges::copy(modes, modes_.begin());
}

const Mode& FlexibleAxis::main() const {
  return *std::ranges::max_element(modes(), {}, [](const Mode& m) { return std::abs(m.gain); });
}

double FlexibleAxis::main_hz() const { return main().omega_rad_s / (2.0 * std::numbers::pi); }

double FlexibleAxis::slowest_rad_s() const {
  return std::ranges::min(modes(), {}, &Mode::omega_rad_s).omega_rad_s;
}

double FlexibleAxis::fastest_rad_s() const {
  return std::ranges::max(modes(), {}, &Mode::omega_rad_s).omega_rad_s;
}

double FlexibleAxis::settling_s() const {
  double longest_s = 0.0;
  for (const Mode& mode : modes()) {
    longest_s = std::max(longest_s, 4.0 / (mode.zeta * mode.omega_rad_s));
  }
  return longest_s;
}

double FlexibleAxis::ringing_s(double least_zeta) const {
  double longest_s = 0.0;
  for (const Mode& mode : modes()) {
    longest_s =
        std::max(longest_s, 1.0 / (4.0 * std::max(mode.zeta, least_zeta) * mode.omega_rad_s));
  }
  return longest_s;
}

double FlexibleAxis::decay_per_s() const {
  const auto of_mode = [](const Mode& mode) {
    return mode.zeta < 1.0 ? mode.zeta * mode.omega_rad_s : 0.5 * mode.omega_rad_s / mode.zeta;
  };
  return of_mode(std::ranges::min(modes(), {}, of_mode));
}

double FlexibleAxis::largest_lag_mm(double accel_mm_s2, double velocity_mm_s) const {
  double sum_mm = 0.0;
  for (const Mode& mode : modes()) {
    const double omega = mode.omega_rad_s;
    sum_mm += std::abs(mode.gain) *
                  (accel_mm_s2 / (omega * omega) + 2.0 * mode.zeta / omega * velocity_mm_s) +
              std::abs(mode.lead_s) * velocity_mm_s;
  }
  return sum_mm;
}

double FlexibleAxis::stiffness_per_s2() const {
  double sum = 0.0;
  for (const Mode& mode : modes()) {
    sum += mode.gain * mode.stiffness_per_s2();
  }
  return sum;
}

double FlexibleAxis::damping_per_s() const {
  double sum = 0.0;
  for (const Mode& mode : modes()) {
    sum += mode.gain * mode.damping_per_s() + mode.stiffness_per_s2() * mode.lead_s;
  }
  return sum;
}

// Σ (g_i (2ζ_i ω_i s + ω_i²) + ω_i² τ_i s) Π_{j≠i} (s² + 2ζ_j ω_j s + ω_j²) = 0, by the eigenvalues
// of the polynomial's companion matrix.
std::vector<std::complex<double>> FlexibleAxis::zeros() const {
  // Frequencies relative to the first one's, so that coefficients are of like size.
  const double unit = modes_[0].omega_rad_s;
  Eigen::VectorXd numerator = Eigen::VectorXd::Zero(2 * static_cast<Eigen::Index>(count_));
  for (std::size_t i = 0; i < count_; ++i) {
    const double omega = modes_[i].omega_rad_s / unit;
    Eigen::VectorXd term =
        modes_[i].gain * Eigen::Vector2d(omega * omega, 2.0 * modes_[i].zeta * omega);
    term[1] += omega * omega * modes_[i].lead_s * unit;
    for (std::size_t j = 0; j < count_; ++j) {
      if (j != i) {
        const double other = modes_[j].omega_rad_s / unit;
        term = product(term, Eigen::Vector3d(other * other, 2.0 * modes_[j].zeta * other, 1.0));
      }
    }
    numerator += term;
  }
  // Where the highest coefficient vanishes but for rounding, its zero lies at infinity.
  constexpr double kVanishing = 1e-13;
  Eigen::Index degree = numerator.size() - 1;
  while (degree > 0 && std::abs(numerator[degree]) < kVanishing * numerator.cwiseAbs().maxCoeff()) {
    --degree;
  }
  Eigen::MatrixXd companion = Eigen::MatrixXd::Zero(degree, degree);
  for (Eigen::Index i = 0; i < degree; ++i) {
    companion(i, degree - 1) = -numerator[i] / numerator[degree];
    if (i > 0) {
      companion(i, i - 1) = 1.0;
    }
  }
  if (!companion.allFinite()) {
    return {};
  }
  const Eigen::VectorXcd values = companion.eigenvalues() * unit;
  return {values.begin(), values.end()};
}

double FlexibleAxis::unseen_s() const {
  if (count_ < 2) {
    return 0.0;
  }
  // The motion at a zero with a positive real part dies away backwards in time, so its rate counts
  // too. Slower rates count as kLeast_per_s.
  constexpr double kLeast_per_s = 10.0;
  double slowest_per_s = std::numeric_limits<double>::infinity();
  for (const std::complex<double>& zero : zeros()) {
    slowest_per_s = std::min(slowest_per_s, std::abs(zero.real()));
  }
  return math::log(1e5) / std::max(slowest_per_s, kLeast_per_s);
}

// N_i and D_i are the numerator and denominator of mode i. a s + b and α s + β solve
//   (a s + b) D₂ + (α s + β) D_i = N_i N₂.
FlexibleAxis FlexibleAxis::followed_by(double omega_rad_s, double zeta) const {
  const double unit = omega_rad_s;
  const Eigen::Vector3d last(1.0, 2.0 * zeta, 1.0);  // from the constant on
  const auto mode_of = [&](double omega, double damping, double constant, double slope) {
    const double gain = constant / (omega * omega);
    return Mode{omega * unit, damping, gain,
                (slope - 2.0 * damping * omega * gain) / (omega * omega) / unit};
  };
  FlexibleAxis axis = *this;
  double constant = 0.0;
  double slope = 0.0;
  for (std::size_t i = 0; i < count_; ++i) {
    const Mode& mode = modes_[i];
    const double omega = mode.omega_rad_s / unit;
    const Eigen::Vector3d own(omega * omega, 2.0 * mode.zeta * omega, 1.0);
    const Eigen::Vector2d numerator(mode.gain * own[0],
                                    mode.gain * own[1] + omega * omega * mode.lead_s * unit);
    Eigen::Matrix4d parts = Eigen::Matrix4d::Zero();
    for (Eigen::Index k = 0; k < 2; ++k) {
      parts.block<3, 1>(k, k) = last;
      parts.block<3, 1>(k, k + 2) = own;
    }
    Eigen::Vector4d right = Eigen::Vector4d::Zero();
    right.head<3>() = product(numerator, last.head<2>());
    const Eigen::Vector4d found = parts.partialPivLu().solve(right);
    axis.modes_[i] = mode_of(omega, mode.zeta, found[0], found[1]);
    constant += found[2];
    slope += found[3];
  }
  axis.modes_[axis.count_++] = mode_of(1.0, zeta, constant, slope);
  return axis;
}

FlexibleAxis FlexibleAxis::detuned(double freq_factor, double damping_factor) const {
  FlexibleAxis axis = *this;
  for (Mode& mode : axis.modes_) {
    mode.omega_rad_s *= freq_factor;
    mode.zeta *= damping_factor;
    mode.lead_s /= freq_factor;
  }
  return axis;
}

NozzleState FlexibleAxis::riding(double position_mm, double velocity_mm_s) const {
  NozzleState state;
  for (std::size_t i = 0; i < count_; ++i) {
    state.parts[i] = {modes_[i].gain * position_mm + modes_[i].lead_s * velocity_mm_s,
                      modes_[i].gain * velocity_mm_s};
  }
  return state;
}

NozzleState FlexibleAxis::swinging_as(const FlexibleAxis& other, const NozzleState& nozzle,
                                      double base_mm) const {
  if (other.count_ != count_) {
    // Which mode swings is not known, so all modes swing in proportion to their gains.
    return riding(nozzle.position(), nozzle.velocity());
  }
  NozzleState state = nozzle;
  for (std::size_t i = 0; i < count_; ++i) {
    state.parts[i].position += (modes_[i].gain - other.modes_[i].gain) * base_mm;
  }
  return state;
}

FlexibleAxis::Gap FlexibleAxis::gap(const NozzleState& a, const NozzleState& b) const {
  Gap sum;
  for (std::size_t i = 0; i < count_; ++i) {
    sum.place_mm += std::abs(a.parts[i].position - b.parts[i].position);
    sum.speed_mm += std::abs((a.parts[i].velocity - b.parts[i].velocity) / modes_[i].omega_rad_s);
  }
  return sum;
}

FlexibleAxis from_frequency(double freq_hz, double damping_ratio) {
  return {2.0 * std::numbers::pi * freq_hz, damping_ratio};
}

NozzleState rk4_step(const FlexibleAxis& axis, const NozzleState& state, const BaseSegment& base,
                     double h) {
  NozzleState next;
  const std::span<const Mode> modes = axis.modes();
  for (std::size_t i = 0; i < modes.size(); ++i) {
    next.parts[i] = rk4_part(modes[i], state.parts[i], base, h);
  }
  return next;
}

NozzleState exact_step(const FlexibleAxis& axis, const NozzleState& state, const BaseSegment& base,
                       double h) {
  NozzleState next;
  const std::span<const Mode> modes = axis.modes();
  for (std::size_t i = 0; i < modes.size(); ++i) {
    next.parts[i] = exact_part(modes[i], state.parts[i], base, h);
  }
  return next;
}

ExactMap::ExactMap(const FlexibleAxis& axis, double h) : count_(axis.modes().size()) {
  for (std::size_t i = 0; i < count_; ++i) {
    const Mode& mode = axis.modes()[i];
    maps_[i] = {mode.gain, exact_part(mode, {1.0, 0.0}, {}, h), exact_part(mode, {0.0, 1.0}, {}, h),
                exact_part(mode, {}, {0.0, 1.0, 0.0}, h), exact_part(mode, {}, {0.0, 0.0, 1.0}, h)};
  }
}

}  // namespace unflex::dynamics
