// Notation, for one axis:
//   t_k, T     end of line k, its duration          b     base, chords between the b(t_k)
//   o_k        vertex k minus b(t_k)                p     nozzle that follows the base
//   y          state (e, ė) of the nozzle that follows the polygon, minus (p, ṗ)
//   z_k        (y, o_k);  u = o_{k+1}
//   ε          weight of the polygon's own distance from the base
//
// A linear-quadratic regulator: min Σ ∫ e² + ε d² dt with z_{k+1} = M (z_k, u) + m_k, where d is
// the polygon minus the base. The gains come from the end of the run to its beginning (Riccati; see
// Anderson & Moore, Optimal Control: Linear Quadratic Methods, § 2.4 and 4.1), then the vertices
// from the beginning on. Each is put on the grid before the next one is chosen, so that those to
// come make up for its rounding.
#include "vertices.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>

namespace unflex::emit {
namespace {

using dynamics::BaseTrajectory;
using dynamics::FlexibleAxis;

// One line: where it takes y, and what it costs: ½ wᵀHw + hᵀw for w = (z, u).
struct Stage {
  Eigen::Matrix<double, 2, 4> move = Eigen::Matrix<double, 2, 4>::Zero();
  Eigen::Vector2d shift = Eigen::Vector2d::Zero();
  Eigen::Matrix4d cost = Eigen::Matrix4d::Zero();
  Eigen::Vector4d slope = Eigen::Vector4d::Zero();
  // The law u = feedback · z + feed_forward.
  Eigen::RowVector3d feedback = Eigen::RowVector3d::Zero();
  double feed_forward = 0.0;
};

Stage stage(const BaseTrajectory& base, AxisAt axis, const Followed& followed, const Step& step,
            double from, double to) {
  Stage result;
  const double duration = to - from;
  const int steps = static_cast<int>(std::lround(duration / step.dt()));
  const double b0 = (base.*axis)(from).position_mm;
  const double slope = ((base.*axis)(to).position_mm - b0) / duration;
  const auto add_square = [&](const Eigen::RowVector4d& row, double value, double weight) {
    result.cost += weight * row.transpose() * row;
    result.slope += weight * value * row.transpose();
  };
  // The nozzle's answer to (y, o, u), and to the chord alone.
  Eigen::Matrix<double, 2, 4> answer = Eigen::Matrix<double, 2, 4>::Zero();
  answer.leftCols<2>().setIdentity();
  Eigen::Vector2d chord = followed.at(from) - Eigen::Vector2d(b0, 0.0);
  for (int i = 0; i < steps; ++i) {
    const double s = static_cast<double>(i) / steps;
    answer = step.free() * answer;
    answer.col(2) += step.base(1.0 - s, -1.0 / duration);
    answer.col(3) += step.base(s, 1.0 / duration);
    chord = step.free() * chord + step.base(slope * s * duration, slope);
    const double end = s + 1.0 / steps;
    const double t = from + end * duration;
    const Eigen::Vector2d off = chord - (followed.at(t) - Eigen::Vector2d(b0, 0.0));
    add_square(answer.row(0), off[0], step.dt());
    const double chord_off = slope * end * duration - ((base.*axis)(t).position_mm - b0);
    add_square({0.0, 0.0, 1.0 - end, end}, chord_off, kBaseWeight * step.dt());
    if (i + 1 == steps) {
      result.shift = off;
    }
  }
  result.move = answer;
  return result;
}

// ½ zᵀPz + pᵀz: what is still to come.
struct CostToGo {
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
  Eigen::Vector3d slope = Eigen::Vector3d::Zero();
};

// Sets the line's law and takes its cost to the cost to go. A pinned vertex is not free: u = 0.
void regulate(Stage& line, CostToGo& to_go, bool pinned) {
  Eigen::Matrix<double, 3, 4> next = Eigen::Matrix<double, 3, 4>::Zero();
  next.topRows<2>() = line.move;
  next(2, 3) = 1.0;
  const Eigen::Vector3d constant(line.shift[0], line.shift[1], 0.0);
  const Eigen::Matrix4d cost = line.cost + next.transpose() * to_go.matrix * next;
  const Eigen::Vector4d slope =
      line.slope + next.transpose() * (to_go.matrix * constant + to_go.slope);
  to_go.matrix = cost.topLeftCorner<3, 3>();
  to_go.slope = slope.head<3>();
  if (pinned) {
    line.feedback.setZero();
    line.feed_forward = 0.0;
  } else {
    line.feedback = -cost.row(3).head<3>() / cost(3, 3);
    line.feed_forward = -slope[3] / cost(3, 3);
    to_go.matrix += cost.col(3).head<3>() * line.feedback;
    to_go.slope += line.feedback.transpose() * slope[3];
  }
}

// `reach`, and as far as the base itself goes.
Reach with_base(Reach reach, const BaseTrajectory& base, AxisAt axis) {
  for (std::size_t k = 0; k < base.nodes(); ++k) {
    const double at = (base.*axis)(static_cast<double>(k) * base.period_s).position_mm;
    reach.min_mm = std::min(reach.min_mm, at);
    reach.max_mm = std::max(reach.max_mm, at);
  }
  return reach;
}

// Pins the vertices around changes of speed that are too quick, those from and to rest at the ends
// included; whether there were any to pin.
bool pin_where_too_quick(const std::vector<double>& times, const std::vector<double>& at,
                         double max_accel_mm_s2, Ends ends, std::size_t around,
                         std::vector<bool>& pinned) {
  bool found = false;
  const std::size_t last = times.size() - 1;
  for (std::size_t i = ends.from_rest ? 0 : 1; i + (ends.to_rest ? 0 : 1) <= last; ++i) {
    const double before_s = i > 0 ? times[i] - times[i - 1] : 0.0;
    const double after_s = i < last ? times[i + 1] - times[i] : 0.0;
    const double before = i > 0 ? (at[i] - at[i - 1]) / before_s : 0.0;
    const double after = i < last ? (at[i + 1] - at[i]) / after_s : 0.0;
    if (std::abs(after - before) <= max_accel_mm_s2 * 0.5 * (before_s + after_s)) {
      continue;
    }
    for (std::size_t k = i > around ? i - around : 0; k <= std::min(i + around, last); ++k) {
      found = found || !pinned[k];
      pinned[k] = true;
    }
  }
  return found;
}

}  // namespace

double AxisGrid::nearest(double position_mm) const {
  return offset_mm + std::round((position_mm - offset_mm) / step_mm) * step_mm;
}

VertexChooser::VertexChooser(const BaseTrajectory& base, AxisAt axis, const FlexibleAxis& nozzle)
    : base_(&base), axis_(axis), nozzle_(nozzle), followed_(base, axis, nozzle) {}

AxisVertices VertexChooser::choose(const std::vector<double>& times, const AxisGrid& grid,
                                   const Reach& reach, double max_accel_mm_s2, Ends ends) const {
  const BaseTrajectory& base = *base_;
  const AxisAt axis = axis_;
  const std::size_t lines = times.size() - 1;
  std::map<std::int64_t, Step> steps;  // by length; few lengths are different
  std::vector<Stage> stages;
  std::vector<double> on_curve = {(base.*axis)(0.0).position_mm};
  for (std::size_t k = 0; k < lines; ++k) {
    const double duration = times[k + 1] - times[k];
    const double dt = duration / std::ceil(duration / base.period_s - 1e-9);
    constexpr double kSame_s = 1e-12;
    const Step& step = steps.try_emplace(std::llround(dt / kSame_s), nozzle_, dt).first->second;
    stages.push_back(stage(base, axis, followed_, step, times[k], times[k + 1]));
    on_curve.push_back((base.*axis)(times[k + 1]).position_mm);
  }
  const Reach within = with_base(reach, base, axis);
  // After the run e rings down.
  CostToGo at_end;
  at_end.matrix.topLeftCorner<2, 2>() = ring_down_square(nozzle_);
  std::vector<bool> pinned(lines + 1, false);
  pinned.front() = pinned.back() = true;
  AxisVertices result;
  // Pinning moves the neighbours; the further around, the sooner that ends.
  for (std::size_t around = 1;; around *= 2) {
    CostToGo to_go = at_end;
    for (std::size_t k = lines; k-- > 0;) {
      regulate(stages[k], to_go, pinned[k + 1]);
    }
    result = {{on_curve.front()}, {0.0}};
    Eigen::Vector3d z = Eigen::Vector3d::Zero();
    for (std::size_t k = 0; k < lines; ++k) {
      double vertex = on_curve[k + 1];
      if (k + 1 < lines) {
        const double offset = stages[k].feedback * z + stages[k].feed_forward;
        vertex = grid.nearest(std::clamp(vertex + offset, within.min_mm, within.max_mm));
      }
      Eigen::Vector4d w;
      w << z, vertex - on_curve[k + 1];
      z << stages[k].move * w + stages[k].shift, w[3];
      result.position_mm.push_back(vertex);
      result.nozzle_error_mm.push_back(z[0]);
    }
    if (!pin_where_too_quick(times, result.position_mm, max_accel_mm_s2, ends, around, pinned)) {
      return result;
    }
  }
}

}  // namespace unflex::emit
