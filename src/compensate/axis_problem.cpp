#include "axis_problem.hpp"

#include <algorithm>
#include <cmath>

#include "unflex/nlp/problem.hpp"

namespace unflex::compensate {

using collocation::ControlVector;
using collocation::PointByPoint;
using collocation::PointByPointPattern;
using collocation::PointVector;
using collocation::StateByPoint;
using collocation::StateByPointPattern;
using collocation::StateVector;

AxisProblem::AxisProblem(const AxisWindow& window, ActiveLimits active)
    : window_(&window),
      active_(active),
      origin_mm_(window.reference_mm.front()),
      damping_(2.0 * window.axis.zeta * window.axis.omega_rad_s * window.period_s),
      stiffness_(std::pow(window.axis.omega_rad_s * window.period_s, 2)) {}

void AxisProblem::dynamics(double /*t*/, const PointVector& z, StateVector& f) const {
  f(kNozzle) = z(kNozzleRate);
  f(kNozzleRate) =
      damping_ * (z(kBaseRate) - z(kNozzleRate)) + stiffness_ * (z(kBase) - z(kNozzle));
  f(kBase) = z(kBaseRate);
  f(kBaseRate) = z(kBaseAccel);
}

void AxisProblem::dynamics_jacobian(double /*t*/, const PointVector& /*z*/,
                                    StateByPoint& fz) const {
  fz.setZero();
  fz(kNozzle, kNozzleRate) = 1.0;
  fz(kNozzleRate, kNozzle) = -stiffness_;
  fz(kNozzleRate, kNozzleRate) = -damping_;
  fz(kNozzleRate, kBase) = stiffness_;
  fz(kNozzleRate, kBaseRate) = damping_;
  fz(kBase, kBaseRate) = 1.0;
  fz(kBaseRate, kBaseAccel) = 1.0;
}

void AxisProblem::dynamics_hessian(double /*t*/, const PointVector& /*z*/,
                                   const StateVector& /*mu*/, PointByPoint& h) const {
  h.setZero();
}

StateByPointPattern AxisProblem::dynamics_pattern() const {
  StateByPointPattern pattern(4, 5);
  pattern.setConstant(false);
  pattern(kNozzle, kNozzleRate) = true;
  pattern(kNozzleRate, kNozzle) = true;
  pattern(kNozzleRate, kNozzleRate) = true;
  pattern(kNozzleRate, kBase) = true;
  pattern(kNozzleRate, kBaseRate) = true;
  pattern(kBase, kBaseRate) = true;
  pattern(kBaseRate, kBaseAccel) = true;
  return pattern;
}

std::size_t AxisProblem::sample(double t) const {
  return static_cast<std::size_t>(std::lround(2.0 * t));
}

double AxisProblem::cost(double t, const PointVector& z) const {
  const std::size_t i = sample(t);
  const double error = z(kNozzle) - (window_->reference_mm[i] - origin_mm_) / kLengthUnitMm;
  return window_->weight[i] * error * error;
}

void AxisProblem::cost_gradient(double t, const PointVector& z, PointVector& gradient) const {
  const std::size_t i = sample(t);
  gradient.setZero();
  gradient(kNozzle) = 2.0 * window_->weight[i] *
                      (z(kNozzle) - (window_->reference_mm[i] - origin_mm_) / kLengthUnitMm);
}

void AxisProblem::cost_hessian(double t, const PointVector& /*z*/, PointByPoint& h) const {
  h.setZero();
  h(kNozzle, kNozzle) = 2.0 * window_->weight[sample(t)];
}

PointByPointPattern AxisProblem::cost_pattern() const {
  PointByPointPattern pattern(5, 5);
  pattern.setConstant(false);
  pattern(kNozzle, kNozzle) = true;
  return pattern;
}

ControlVector AxisProblem::slope_weight() const {
  return ControlVector::Constant(1, window_->jerk_weight);
}

ControlVector AxisProblem::slope_limit() const {
  const double h = window_->period_s;
  return ControlVector::Constant(
      1, active_.jerk ? window_->limits.max_jerk_mm_s3 * h * h * h / kLengthUnitMm : nlp::kNoBound);
}

void AxisProblem::node_bounds(int k, int n, PointVector& lower, PointVector& upper) const {
  lower.setConstant(-nlp::kNoBound);
  upper.setConstant(nlp::kNoBound);
  const auto bound = [&](Component component, const Interval& interval) {
    if (interval.lower > -nlp::kNoBound) {
      lower(component) = to_scaled(component, interval.lower);
    }
    if (interval.upper < nlp::kNoBound) {
      upper(component) = to_scaled(component, interval.upper);
    }
  };
  const BaseBounds bounds = base_bounds(*window_, active_, static_cast<std::size_t>(k));
  bound(kBase, bounds.position);
  bound(kBaseRate, bounds.velocity);
  bound(kBaseAccel, bounds.accel);
  const auto fix = [&](Component component, double physical) {
    lower(component) = upper(component) = to_scaled(component, physical);
  };
  if (k == 0 && window_->start) {
    fix(kNozzle, window_->start->nozzle.position);
    fix(kNozzleRate, window_->start->nozzle.velocity);
    fix(kBase, window_->start->base_mm);
    fix(kBaseRate, 0.0);
  }
  if (k == n - 1 && window_->end_base_mm) {
    fix(kBase, *window_->end_base_mm);
    fix(kBaseRate, 0.0);
  }
}

void AxisProblem::guess(int k, double /*t*/, PointVector& z) const {
  if (window_->guess) {
    const auto i = static_cast<std::size_t>(k);
    const dynamics::NozzleState& nozzle = window_->guess->nozzle[i];
    const dynamics::AxisTrajectory& base = window_->guess->base;
    z(kNozzle) = to_scaled(kNozzle, nozzle.position);
    z(kNozzleRate) = to_scaled(kNozzleRate, nozzle.velocity);
    z(kBase) = to_scaled(kBase, base.position_mm[i]);
    z(kBaseRate) = to_scaled(kBaseRate, base.velocity_mm_s[i]);
    z(kBaseAccel) = to_scaled(kBaseAccel, base.accel_mm_s2[i]);
    return;
  }
  const auto n = static_cast<int>(window_->nodes());
  const auto r = [&](int node) {
    return window_->reference_mm[static_cast<std::size_t>(2 * std::clamp(node, 0, n - 1))];
  };
  const double rate = 0.5 * (r(k + 1) - r(k - 1)) / kLengthUnitMm;
  z(kNozzle) = z(kBase) = (r(k) - origin_mm_) / kLengthUnitMm;
  z(kNozzleRate) = z(kBaseRate) = rate;
  z(kBaseAccel) = (r(k + 1) - 2.0 * r(k) + r(k - 1)) / kLengthUnitMm;
}

std::string AxisProblem::name(int component) const {
  switch (component) {
    case kNozzle:
      return "nozzle position";
    case kNozzleRate:
      return "nozzle velocity";
    case kBase:
      return "base position";
    case kBaseRate:
      return "base velocity";
    default:
      return "base acceleration";
  }
}

double AxisProblem::to_physical(Component component, double scaled) const {
  const double h = window_->period_s;
  switch (component) {
    case kNozzle:
    case kBase:
      return scaled * kLengthUnitMm + origin_mm_;
    case kNozzleRate:
    case kBaseRate:
      return scaled * kLengthUnitMm / h;
    default:
      return scaled * kLengthUnitMm / (h * h);
  }
}

double AxisProblem::to_scaled(Component component, double physical) const {
  const double h = window_->period_s;
  switch (component) {
    case kNozzle:
    case kBase:
      return (physical - origin_mm_) / kLengthUnitMm;
    case kNozzleRate:
    case kBaseRate:
      return physical * h / kLengthUnitMm;
    default:
      return physical * h * h / kLengthUnitMm;
  }
}

}  // namespace unflex::compensate
