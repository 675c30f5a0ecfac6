// Notation:
//   ω, ζ   natural frequency and damping ratio          b, p   base and nozzle
//   ω_d    ω√(1−ζ²), damped frequency (ζ < 1)            κ      ω√(ζ²−1)      (ζ > 1)
//   y      p minus its steady response to the base: the free motion ÿ + 2ζωẏ + ω²y = 0
//
// The closed form is the textbook solution of the damped oscillator, e.g. Inman, Engineering
// Vibration, 4th ed., eq. 1.36 to 1.46.
#include "unflex/dynamics/flexible_axis.hpp"

#include <cmath>
#include <numbers>

namespace unflex::dynamics {
namespace {

double nozzle_acceleration(const FlexibleAxis& axis, const NozzleState& nozzle,
                           const NozzleState& base) {
  const double omega = axis.omega_rad_s;
  return 2.0 * axis.zeta * omega * (base.velocity - nozzle.velocity) +
         omega * omega * (base.position - nozzle.position);
}

NozzleState base_at(const BaseSegment& base, double t) {
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
  const double decay = std::exp(-zeta * omega * h);
  const double phase = damped * h;
  return {decay * std::cos(phase), decay * (phase > 0.0 ? std::sin(phase) / damped : h)};
}

// With κ for ω_d the circular functions become hyperbolic ones. These would overflow for large κh,
// so we write both with the two decaying exponentials. The slow rate ζω − κ comes from its
// conjugate.
FreeResponse overdamped(double omega, double zeta, double h) {
  const double root = std::sqrt((zeta - 1.0) * (zeta + 1.0));
  const double slow = std::exp(-omega / (zeta + root) * h);
  const double two_kappa_h = 2.0 * omega * root * h;
  const double fast_part = -std::expm1(-two_kappa_h);  // 1 − e^{−2κh}
  return {slow * (1.0 - 0.5 * fast_part),
          slow * h * (two_kappa_h > 0.0 ? fast_part / two_kappa_h : 1.0)};
}

}  // namespace

FlexibleAxis from_frequency(double freq_hz, double damping_ratio) {
  return {2.0 * std::numbers::pi * freq_hz, damping_ratio};
}

NozzleState rk4_step(const FlexibleAxis& axis, NozzleState state, const BaseSegment& base,
                     double h) {
  // moved(): the start moved along `slope` over dt. slope_at(): the slope of (p, ṗ) at `at`.
  const auto moved = [&](const NozzleState& slope, double dt) {
    return NozzleState{state.position + dt * slope.position, state.velocity + dt * slope.velocity};
  };
  const auto slope_at = [&](const NozzleState& at, const NozzleState& base_then) {
    return NozzleState{at.velocity, nozzle_acceleration(axis, at, base_then)};
  };
  const NozzleState base_middle = base_at(base, 0.5 * h);
  const NozzleState k1 = slope_at(state, base_at(base, 0.0));
  const NozzleState k2 = slope_at(moved(k1, 0.5 * h), base_middle);
  const NozzleState k3 = slope_at(moved(k2, 0.5 * h), base_middle);
  const NozzleState k4 = slope_at(moved(k3, h), base_at(base, h));
  return {
      state.position + h / 6.0 * (k1.position + 2.0 * (k2.position + k3.position) + k4.position),
      state.velocity + h / 6.0 * (k1.velocity + 2.0 * (k2.velocity + k3.velocity) + k4.velocity)};
}

StepMap::StepMap(OneStep one_step, const FlexibleAxis& axis, double h)
    : of_position_(one_step(axis, {1.0, 0.0}, {}, h)),
      of_velocity_(one_step(axis, {0.0, 1.0}, {}, h)),
      of_base_velocity_(one_step(axis, {}, {0.0, 1.0, 0.0}, h)),
      of_base_acceleration_(one_step(axis, {}, {0.0, 0.0, 1.0}, h)) {}

Rk4Map::Rk4Map(const FlexibleAxis& axis, double h) : StepMap(&rk4_step, axis, h) {}
ExactMap::ExactMap(const FlexibleAxis& axis, double h) : StepMap(&exact_step, axis, h) {}

NozzleState exact_step(const FlexibleAxis& axis, NozzleState state, const BaseSegment& base,
                       double h) {
  const double omega = axis.omega_rad_s;
  const double zeta = axis.zeta;
  // Under constant acceleration of the base the nozzle settles a/ω² behind it.
  const double lag = base.acceleration / (omega * omega);
  const double y0 = state.position - base.position + lag;
  const double yd0 = state.velocity - base.velocity;

  const FreeResponse free = zeta < 1.0 ? underdamped(omega, zeta, h) : overdamped(omega, zeta, h);
  const double y = free.c * y0 + free.s * (zeta * omega * y0 + yd0);
  const double yd = free.c * yd0 - free.s * (zeta * omega * yd0 + omega * omega * y0);

  const NozzleState base_end = base_at(base, h);
  return {base_end.position - lag + y, base_end.velocity + yd};
}

}  // namespace unflex::dynamics
