#include "axis_problem.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "unflex/core/math.hpp"
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
    : window_(&window), active_(active), origin_mm_(window.reference_mm.front()) {
  SharedModes shared = shared_modes(window);
  for (const SharedModes::Swing& swing : shared.modes) {
    const double omega_h = swing.mode.omega_rad_s * window.period_s;
    modes_.push_back({2.0 * swing.mode.zeta * omega_h, math::square(omega_h)});
  }
  models_ = std::move(shared.models);
}

int AxisProblem::place(Component component, std::size_t mode) const {
  if (component == kBaseAccel) {
    return states();
  }
  const bool other_mode = mode > 0 && (component == kNozzle || component == kNozzleRate);
  return component + (other_mode ? 2 + 2 * static_cast<int>(mode) : 0);
}

AxisProblem::Mode AxisProblem::mode_at(std::size_t i, double t) const {
  const Mode& mode = modes_[i];
  if (window_->freq_shares.empty()) {
    return mode;
  }
  const double share = window_->freq_shares[sample(t)];
  return {share * mode.damping, math::square(share) * mode.stiffness};
}

void AxisProblem::dynamics(double t, const PointVector& z, StateVector& f) const {
  for (std::size_t i = 0; i < modes_.size(); ++i) {
    const int q = place(kNozzle, i);
    const int rate = place(kNozzleRate, i);
    const Mode mode = mode_at(i, t);
    f(q) = z(rate);
    f(rate) = mode.damping * (z(kBaseRate) - z(rate)) + mode.stiffness * (z(kBase) - z(q));
  }
  f(kBase) = z(kBaseRate);
  f(kBaseRate) = z(place(kBaseAccel));
}

void AxisProblem::dynamics_jacobian(double t, const PointVector& /*z*/, StateByPoint& fz) const {
  fz.setZero();
  for (std::size_t i = 0; i < modes_.size(); ++i) {
    const int q = place(kNozzle, i);
    const int rate = place(kNozzleRate, i);
    const Mode mode = mode_at(i, t);
    fz(q, rate) = 1.0;
    fz(rate, q) = -mode.stiffness;
    fz(rate, rate) = -mode.damping;
    fz(rate, kBase) = mode.stiffness;
    fz(rate, kBaseRate) = mode.damping;
  }
  fz(kBase, kBaseRate) = 1.0;
  fz(kBaseRate, place(kBaseAccel)) = 1.0;
}

void AxisProblem::dynamics_hessian(double /*t*/, const PointVector& /*z*/,
                                   const StateVector& /*mu*/, PointByPoint& h) const {
  h.setZero();
}

StateByPointPattern AxisProblem::dynamics_pattern() const {
  StateByPointPattern pattern(states(), states() + 1);
  pattern.setConstant(false);
  for (std::size_t i = 0; i < modes_.size(); ++i) {
    const int q = place(kNozzle, i);
    const int rate = place(kNozzleRate, i);
    pattern(q, rate) = true;
    for (const int of : {q, rate, place(kBase), place(kBaseRate)}) {
      pattern(rate, of) = true;
    }
  }
  pattern(kBase, kBaseRate) = true;
  pattern(kBaseRate, place(kBaseAccel)) = true;
  return pattern;
}

std::size_t AxisProblem::sample(double t) const {
  return static_cast<std::size_t>(std::lround(2.0 * t));
}

double AxisProblem::error(std::size_t model, std::size_t sampled, const PointVector& z) const {
  double nozzle = 0.0;
  for (const auto& [mode, gain] : models_[model].parts) {
    nozzle += gain * z(place(kNozzle, mode));
  }
  return nozzle - to_scaled(kNozzle, window_->aim_mm(model)[sampled]);
}

double AxisProblem::cost(double t, const PointVector& z) const {
  const std::size_t sampled = sample(t);
  double sum = 0.0;
  for (std::size_t i = 0; i < models_.size(); ++i) {
    const double away = error(i, sampled, z);
    sum += models_[i].share * away * away;
  }
  return window_->weight[sampled] * sum;
}

void AxisProblem::cost_gradient(double t, const PointVector& z, PointVector& gradient) const {
  const std::size_t sampled = sample(t);
  gradient.setZero();
  for (std::size_t i = 0; i < models_.size(); ++i) {
    const double slope = 2.0 * window_->weight[sampled] * models_[i].share * error(i, sampled, z);
    for (const auto& [mode, gain] : models_[i].parts) {
      gradient(place(kNozzle, mode)) += slope * gain;
    }
  }
}

void AxisProblem::cost_hessian(double t, const PointVector& /*z*/, PointByPoint& h) const {
  h.setZero();
  for (const SharedModes::Model& model : models_) {
    const double bend = 2.0 * window_->weight[sample(t)] * model.share;
    for (const auto& [i, gain_i] : model.parts) {
      for (const auto& [j, gain_j] : model.parts) {
        h(place(kNozzle, i), place(kNozzle, j)) += bend * gain_i * gain_j;
      }
    }
  }
}

PointByPointPattern AxisProblem::cost_pattern() const {
  PointByPointPattern pattern(states() + 1, states() + 1);
  pattern.setConstant(false);
  for (const SharedModes::Model& model : models_) {
    for (const SharedModes::Part& i : model.parts) {
      for (const SharedModes::Part& j : model.parts) {
        pattern(place(kNozzle, i.mode), place(kNozzle, j.mode)) = true;
      }
    }
  }
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
      lower(place(component)) = to_scaled(component, interval.lower);
    }
    if (interval.upper < nlp::kNoBound) {
      upper(place(component)) = to_scaled(component, interval.upper);
    }
  };
  const BaseBounds bounds = base_bounds(*window_, active_, static_cast<std::size_t>(k));
  bound(kBase, bounds.position);
  bound(kBaseRate, bounds.velocity);
  bound(kBaseAccel, bounds.accel);
  const auto fix = [&](Component component, double physical) {
    const int at = place(component);
    lower(at) = upper(at) = to_scaled(component, physical);
  };
  if (k == 0 && window_->start) {
    set_nozzle(window_->start->nozzle, window_->start->base_mm, lower);
    set_nozzle(window_->start->nozzle, window_->start->base_mm, upper);
    fix(kBase, window_->start->base_mm);
    fix(kBaseRate, 0.0);
  }
  if (k == n - 1 && window_->end_base_mm) {
    fix(kBase, *window_->end_base_mm);
    fix(kBaseRate, 0.0);
  }
}

void AxisProblem::set_nozzle(const dynamics::NozzleState& nozzle, double base_mm,
                             PointVector& z) const {
  for (std::size_t i = 0; i < models_.size(); ++i) {
    const dynamics::NozzleState state = window_->in_model(i, nozzle, base_mm);
    for (std::size_t part = 0; part < models_[i].parts.size(); ++part) {
      const auto& [mode, gain] = models_[i].parts[part];
      // A mode without gain goes along with the base.
      const bool swings = gain != 0.0;
      const double place_mm = swings ? state.parts[part].position / gain : base_mm;
      const double rate_mm_s = swings ? state.parts[part].velocity / gain : 0.0;
      z(place(kNozzle, mode)) = to_scaled(kNozzle, place_mm);
      z(place(kNozzleRate, mode)) = to_scaled(kNozzleRate, rate_mm_s);
    }
  }
}

void AxisProblem::guess(int k, double /*t*/, PointVector& z) const {
  dynamics::NozzleState nozzle;
  dynamics::AxisMotion base;
  if (window_->guess) {
    const auto i = static_cast<std::size_t>(k);
    const dynamics::AxisTrajectory& guessed = window_->guess->base;
    nozzle = window_->guess->nozzle[i];
    base = {guessed.position_mm[i], guessed.velocity_mm_s[i], guessed.accel_mm_s2[i]};
  } else {
    const auto n = static_cast<int>(window_->nodes());
    const double h = window_->period_s;
    const auto r = [&](int node) {
      return window_->reference_mm[static_cast<std::size_t>(2 * std::clamp(node, 0, n - 1))];
    };
    const double rate = 0.5 * (r(k + 1) - r(k - 1)) / h;
    nozzle = window_->axis.riding(r(k), rate);
    base = {r(k), rate, (r(k + 1) - 2.0 * r(k) + r(k - 1)) / (h * h)};
  }
  set_nozzle(nozzle, base.position_mm, z);
  z(kBase) = to_scaled(kBase, base.position_mm);
  z(kBaseRate) = to_scaled(kBaseRate, base.velocity_mm_s);
  z(place(kBaseAccel)) = to_scaled(kBaseAccel, base.accel_mm_s2);
}

std::string AxisProblem::name(int component) const {
  switch (component) {
    case kBase:
      return "base position";
    case kBaseRate:
      return "base velocity";
    default:
      break;
  }
  if (component == place(kBaseAccel)) {
    return "base acceleration";
  }
  return component % 2 == 0 ? "nozzle position" : "nozzle velocity";
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
