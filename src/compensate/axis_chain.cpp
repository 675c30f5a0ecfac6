#include "axis_chain.hpp"

#include <Eigen/LU>
#include <algorithm>

#include "axis_problem.hpp"

namespace unflex::compensate {
namespace {

Interval scaled(const Interval& physical, double offset, double unit) {
  return {(physical.lower - offset) / unit, (physical.upper - offset) / unit};
}

}  // namespace

AxisChain::AxisChain(double omega_h, double zeta) {
  const double damping = 2.0 * zeta * omega_h;
  const double stiffness = omega_h * omega_h;
  Eigen::Matrix4d f;
  f << 0.0, 1.0, 0.0, 0.0,                       //
      -stiffness, -damping, stiffness, damping,  //
      0.0, 0.0, 0.0, 1.0,                        //
      0.0, 0.0, 0.0, 0.0;
  const Eigen::Vector4d g = Eigen::Vector4d::UnitW();
  const Eigen::PartialPivLU<Eigen::Matrix4d> implicit(Eigen::Matrix4d::Identity() - f / 2.0 +
                                                      f * f / 12.0);
  growth.setZero();
  growth.topLeftCorner<4, 4>() = implicit.solve(f);
  growth.topRightCorner<4, 1>() = implicit.solve(g);
  input.head<4>() = implicit.solve(Eigen::Vector4d(g / 2.0 - f * g / 12.0));
  input(kBaseAccel) = 1.0;
}

void ScaledWindow::assign(const AxisWindow& from) {
  window = &from;
  nodes = from.nodes();
  origin_mm = from.reference_mm.front();
  const double h = from.period_s;
  unit = {kLengthUnitMm, kLengthUnitMm / h, kLengthUnitMm / (h * h), kLengthUnitMm / (h * h * h)};
  set_aims();
  jerk_weight = from.jerk_weight;
  start.reset();
  if (from.start) {
    start = {to_scaled_position(from.start->nozzle.position()),
             from.start->nozzle.velocity() / unit[1], to_scaled_position(from.start->base_mm), 0.0};
  }
  end_base.reset();
  if (from.end_base_mm) {
    end_base = to_scaled_position(*from.end_base_mm);
  }
}

void ScaledWindow::set_aims() {
  aims.resize(std::max<std::size_t>(window->aims_mm.size(), 1));
  for (std::size_t i = 0; i < aims.size(); ++i) {
    const std::vector<double>& aim_mm = window->aim_mm(i);
    aims[i].resize(aim_mm.size());
    std::ranges::transform(aim_mm, aims[i].begin(),
                           [&](double mm) { return to_scaled_position(mm); });
  }
}

double ScaledWindow::to_scaled_position(double mm) const {
  return (mm - origin_mm) / kLengthUnitMm;
}

void ScaledWindow::keep_ends(dynamics::AxisTrajectory& base) const {
  if (window->start) {
    base.position_mm.front() = window->start->base_mm;
    base.velocity_mm_s.front() = 0.0;
  }
  if (window->end_base_mm) {
    base.position_mm.back() = *window->end_base_mm;
    base.velocity_mm_s.back() = 0.0;
  }
}

PerKind<std::optional<RowBounds>> row_bounds(const ScaledWindow& scaled_window,
                                             const ActiveLimits& active) {
  const AxisWindow& window = *scaled_window.window;
  const auto at = [&](std::size_t k) {
    BaseBounds bounds = base_bounds(window, active, k);
    if (resting_base_mm(window, k)) {
      bounds.position = bounds.velocity = {};
    }
    return bounds;
  };
  const std::size_t last = scaled_window.nodes - 1;
  const std::array<BaseBounds, 3> nodes = {at(0), base_bounds(window, active, 1), at(last)};
  PerKind<std::optional<RowBounds>> result;
  const auto set = [&](RowKind kind, double offset, const auto& of) {
    const std::size_t i = index_of(kind);
    const auto interval = [&](const auto& node) {
      return scaled(of(node), offset, scaled_window.unit[i]);
    };
    const RowBounds bounds{interval(nodes[0]), interval(nodes[1]), interval(nodes[2])};
    if (bounds.first.bounded() || bounds.inner.bounded() || bounds.last.bounded()) {
      result[i] = bounds;
    }
  };
  // Sets the bounds of a kind at each node, for kinds whose bounds may differ from node to node.
  const auto set_each = [&](RowKind kind, const std::vector<double>& differing, const auto& of) {
    std::optional<RowBounds>& bounds = result[index_of(kind)];
    if (differing.empty() || !bounds) {
      return;
    }
    for (std::size_t k = 0; k < scaled_window.nodes; ++k) {
      bounds->each.push_back(scaled(of(at(k)), 0.0, scaled_window.unit[index_of(kind)]));
      if (k > 0 && k + 1 < scaled_window.nodes) {
        bounds->inner.lower = std::min(bounds->inner.lower, bounds->each.back().lower);
        bounds->inner.upper = std::max(bounds->inner.upper, bounds->each.back().upper);
      }
    }
  };
  set(RowKind::position, scaled_window.origin_mm, [](const BaseBounds& b) { return b.position; });
  set(RowKind::velocity, 0.0, [](const BaseBounds& b) { return b.velocity; });
  set(RowKind::accel, 0.0, [](const BaseBounds& b) { return b.accel; });
  set_each(RowKind::velocity, window.max_velocity_at_mm_s,
           [](const BaseBounds& b) { return b.velocity; });
  set_each(RowKind::accel, window.max_accel_at_mm_s2, [](const BaseBounds& b) { return b.accel; });
  if (active.jerk) {
    const Interval jerk{-window.limits.max_jerk_mm_s3, window.limits.max_jerk_mm_s3};
    set(RowKind::jerk, 0.0, [&](const BaseBounds&) { return jerk; });
  }
  return result;
}

}  // namespace unflex::compensate
