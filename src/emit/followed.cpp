#include "followed.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace unflex::emit {
namespace {

// Integration steps per node period.
constexpr int kSubsteps = 4;

}  // namespace

StepMatrix::StepMatrix(const dynamics::FlexibleAxis& axis, double dt) : dt_(dt) {
  const auto column = [&](int i, dynamics::NozzleState from, dynamics::BaseSegment base) {
    const dynamics::NozzleState to = dynamics::exact_step(axis, from, base, dt);
    columns_.col(i) << to.position, to.velocity;
  };
  column(0, {1.0, 0.0}, {});
  column(1, {0.0, 1.0}, {});
  column(2, {}, {1.0, 0.0, 0.0});
  column(3, {}, {0.0, 1.0, 0.0});
  column(4, {}, {0.0, 0.0, 1.0});
}

Followed::Followed(const dynamics::BaseTrajectory& base, AxisAt axis,
                   const dynamics::FlexibleAxis& nozzle)
    : Followed(base, axis, nozzle,
               {(base.*axis)(0.0).position_mm, (base.*axis)(0.0).velocity_mm_s}) {}

Followed::Followed(const dynamics::BaseTrajectory& base, AxisAt axis,
                   const dynamics::FlexibleAxis& nozzle, const std::array<double, 2>& start)
    : period_s_(base.period_s) {
  const StepMatrix step(nozzle, base.period_s / kSubsteps);
  Eigen::Vector2d state(start[0], start[1]);
  states_.push_back({state[0], state[1]});
  for (std::size_t k = 1; k < base.nodes(); ++k) {
    for (int i = 0; i < kSubsteps; ++i) {
      const double t = base.period_s * static_cast<double>(k - 1) + i * step.dt();
      const dynamics::AxisMotion from = (base.*axis)(t);
      const double middle = (base.*axis)(t + 0.5 * step.dt()).accel_mm_s2;
      const Eigen::Vector2d origin(from.position_mm, 0.0);
      state = step.free() * (state - origin) + step.base(0.0, from.velocity_mm_s, middle) + origin;
    }
    states_.push_back({state[0], state[1]});
  }
}

// Interpolates by cubics between the nodes.
Eigen::Vector2d Followed::at(double t) const {
  const double scaled = t / period_s_;
  const auto k = std::min(static_cast<std::size_t>(std::max(scaled, 0.0)), states_.size() - 2);
  const double s = scaled - static_cast<double>(k);
  const std::array<double, 2>& a = states_[k];
  const std::array<double, 2>& b = states_[k + 1];
  const double rise = b[0] - a[0];
  const double va = a[1] * period_s_;
  const double vb = b[1] * period_s_;
  const double square = 3.0 * rise - 2.0 * va - vb;
  const double cube = va + vb - 2.0 * rise;
  return {a[0] + s * (va + s * (square + s * cube)),
          (va + s * (2.0 * square + 3.0 * s * cube)) / period_s_};
}

Eigen::Matrix2d ring_down_square(const dynamics::FlexibleAxis& axis) {
  const double omega = axis.omega_rad_s;
  const double zeta = std::max(axis.zeta, 0.01);
  const double mixed = 0.5 / (omega * omega);
  Eigen::Matrix2d result;
  result << (1.0 + 4.0 * zeta * zeta) / (4.0 * zeta * omega), mixed, mixed,
      1.0 / (4.0 * zeta * std::pow(omega, 3));
  return result;
}

}  // namespace unflex::emit
