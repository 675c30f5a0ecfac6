#include "unflex/dynamics/node_map.hpp"

namespace unflex::dynamics {
namespace {

// The free motion of y, while the base rests in 0.
NozzleMotion free_motion(const Mode& mode, double place, double rate, double h) {
  const Mode alone{mode.omega_rad_s, mode.zeta};
  return exact_step(FlexibleAxis(std::span(&alone, 1)), {{NozzleMotion{place, rate}}}, {}, h)
      .parts[0];
}

}  // namespace

// Under F + F' t there is the steady motion (F + F' t)/ω² − 2ζF'/ω³, and the rest is free.
NodeMap::NodeMap(const FlexibleAxis& axis, double period_s)
    : period_s_(period_s), count_(axis.mode_count()) {
  for (std::size_t i = 0; i < count_; ++i) {
    const Mode& mode = axis.modes()[i];
    const double omega = mode.omega_rad_s;
    OfMode& map = maps_[i];
    map.gain = mode.gain;
    map.lead_s = mode.lead_s;
    map.push = mode.gain + mode.damping_per_s() * mode.lead_s;
    map.of_place = free_motion(mode, 1.0, 0.0, period_s);
    map.of_rate = free_motion(mode, 0.0, 1.0, period_s);
    const auto under = [&](double force, double slope) {
      const double rate = slope / (omega * omega);
      const double place = force / (omega * omega) - 2.0 * mode.zeta * rate / omega;
      const NozzleMotion left = free_motion(mode, -place, -rate, period_s);
      return NozzleMotion{place + rate * period_s + left.position, rate + left.velocity};
    };
    map.of_force = under(1.0, 0.0);
    map.of_slope = under(0.0, 1.0);
  }
}

}  // namespace unflex::dynamics
