// Notation, for one axis:
//   t_k, T     end of line k, its duration          b     base, chords between the b(t_k)
//   o_k        vertex k minus b(t_k)                p     nozzle that follows the base
//   v_k, c_k   speed of line k, of the chord there  g_k   v_k − c_k
//   y          state (e, ė) of the nozzle that follows the polygon, minus (p, ṗ)
//   z_k        (y, o_k, g_{k−1});  u = g_k − g_{k−1}
//   ε          weight of the polygon's own distance from the base
//
// A linear-quadratic regulator: min Σ ∫ e² + ε d² dt with z_{k+1} = M (z_k, u) + m_k, where d is
// the polygon minus the base. The gains come from the end of the run to its beginning (Riccati; see
// Anderson & Moore, Optimal Control: Linear Quadratic Methods, § 2.4 and 4.1), then the vertices
// from the beginning on. Each is put on the grid before the next one is chosen, so that those to
// come make up for its rounding.
//
// The change of speed v_k − v_{k−1} = u + c_k − c_{k−1} has bounds. So has the change behind the
// last line, which depends on the last g. Where the law above breaks them, bounds are kept by ADMM:
// w is the nearest value within the bounds, λ the scaled dual, and ρ/2 (u − w + λ)² is added to the
// cost. The last g is treated like a u. The gains stay what they are (O'Donoghue, Stathopoulos &
// Boyd, A splitting method for optimal control, IEEE Trans. Control Syst. Technol. 21, 2013). Where
// a bound is still broken by more than a little, the vertices stay on the curve.
#include "vertices.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>

namespace unflex::emit {
namespace {

using dynamics::BaseTrajectory;
using dynamics::FlexibleAxis;

using Vector5 = Eigen::Matrix<double, 5, 1>;
using Matrix5 = Eigen::Matrix<double, 5, 5>;

// Weight of the last vertex's distance from the base, against e² over a second: that vertex is to
// be the base's own.
constexpr double kAtEnd = 1e3;
// ADMM: the most rounds, the change at which it ends, and ρ as a share of what u costs without it.
constexpr int kMostRounds = 200;
constexpr double kSettled_mm_s = 0.02;
constexpr double kPull = 0.3;
// A change of speed may exceed its bounds by this share of their width: ADMM ends a little outside,
// and the last line, which ends where the base does, takes what is left.
constexpr double kOfBounds = 0.02;

struct Bounds {
  double least = 0.0;
  double most = 0.0;

  [[nodiscard]] double nearest(double value) const { return std::clamp(value, least, most); }
  // Whether the value keeps the bounds, but for kOfBounds of their width and the rounding.
  [[nodiscard]] bool hold(double value, double rounding) const {
    const double room = kOfBounds * (most - least) + rounding;
    return value >= least - room && value <= most + room;
  }
};

// One line: where it takes (y, o), and what it costs: ½ wᵀHw + hᵀw for w = (z, u).
struct Stage {
  Eigen::Matrix<double, 4, 5> move = Eigen::Matrix<double, 4, 5>::Zero();
  Eigen::Vector4d shift = Eigen::Vector4d::Zero();
  Matrix5 cost = Matrix5::Zero();
  Vector5 slope = Vector5::Zero();
  double duration_s = 0.0;
  double chord_mm_s = 0.0;
  Bounds bounds;  // of u
  // The law u = feedback · z + feed_forward, and what is needed to find it.
  Eigen::RowVector4d feedback = Eigen::RowVector4d::Zero();
  double feed_forward = 0.0;
  double curvature = 0.0;          // of the cost along u
  Vector5 pull = Vector5::Zero();  // the cost's slope without the cost to go and w
  double target = 0.0;             // w − λ
};

// The cost and the bounds at the end of the last line.
struct Ending {
  Eigen::Matrix4d cost = Eigen::Matrix4d::Zero();
  Bounds bounds;        // of the last g
  double target = 0.0;  // w − λ
};

Stage stage(const BaseTrajectory& base, AxisAt axis, const Followed& followed,
            const StepMatrix& step, double from, double to) {
  const double duration = to - from;
  const int steps = static_cast<int>(std::lround(duration / step.dt()));
  const double b0 = (base.*axis)(from).position_mm;
  const double slope = ((base.*axis)(to).position_mm - b0) / duration;
  // First by where the line begins and ends, (y, o_k, o_{k+1}).
  Eigen::Matrix4d cost = Eigen::Matrix4d::Zero();
  Eigen::Vector4d gradient = Eigen::Vector4d::Zero();
  const auto add_square = [&](const Eigen::RowVector4d& row, double value, double weight) {
    cost += weight * row.transpose() * row;
    gradient += weight * value * row.transpose();
  };
  // The nozzle's answer to these, and to the chord alone.
  Eigen::Matrix<double, 2, 4> answer = Eigen::Matrix<double, 2, 4>::Zero();
  answer.leftCols<2>().setIdentity();
  Eigen::Vector2d chord = followed.at(from) - Eigen::Vector2d(b0, 0.0);
  Eigen::Vector2d off = Eigen::Vector2d::Zero();
  for (int i = 0; i < steps; ++i) {
    const double s = static_cast<double>(i) / steps;
    answer = step.free() * answer;
    answer.col(2) += step.base(1.0 - s, -1.0 / duration);
    answer.col(3) += step.base(s, 1.0 / duration);
    chord = step.free() * chord + step.base(slope * s * duration, slope);
    const double end = s + 1.0 / steps;
    const double t = from + end * duration;
    off = chord - (followed.at(t) - Eigen::Vector2d(b0, 0.0));
    add_square(answer.row(0), off[0], step.dt());
    const double chord_off = slope * end * duration - ((base.*axis)(t).position_mm - b0);
    add_square({0.0, 0.0, 1.0 - end, end}, chord_off, kBaseWeight * step.dt());
  }
  // o_{k+1} = o_k + T (g_{k−1} + u)
  Eigen::Matrix<double, 4, 5> of_speed = Eigen::Matrix<double, 4, 5>::Zero();
  of_speed.leftCols<3>().topRows<3>().setIdentity();
  of_speed.row(3) << 0.0, 0.0, 1.0, duration, duration;
  Stage result;
  result.cost = of_speed.transpose() * cost * of_speed;
  result.slope = of_speed.transpose() * gradient;
  result.move.topRows<2>() = answer * of_speed;
  result.move.row(2) = of_speed.row(3);
  result.move.row(3) << 0.0, 0.0, 0.0, 1.0, 1.0;
  result.shift.head<2>() = off;
  result.duration_s = duration;
  result.chord_mm_s = slope;
  return result;
}

// Sets the feedback of all laws for a pull of ρ towards the targets.
void set_feedback(const Ending& ending, double rho, std::vector<Stage>& stages) {
  Eigen::Matrix4d to_go = ending.cost;
  to_go(3, 3) += rho;
  for (std::size_t k = stages.size(); k-- > 0;) {
    Stage& line = stages[k];
    Matrix5 cost = line.cost + line.move.transpose() * to_go * line.move;
    cost(4, 4) += rho;
    line.pull = line.slope + line.move.transpose() * (to_go * line.shift);
    line.curvature = cost(4, 4);
    line.feedback = -cost.row(4).head<4>() / cost(4, 4);
    to_go = cost.topLeftCorner<4, 4>() + cost.col(4).head<4>() * line.feedback;
  }
}

// Sets the feed-forward of all laws, once the feedback is set.
void set_feed_forward(const Ending& ending, double rho, std::vector<Stage>& stages) {
  Eigen::Vector4d to_go{0.0, 0.0, 0.0, -rho * ending.target};
  for (std::size_t k = stages.size(); k-- > 0;) {
    Stage& line = stages[k];
    Vector5 slope = line.pull + line.move.transpose() * to_go;
    slope[4] -= rho * line.target;
    line.feed_forward = -slope[4] / line.curvature;
    to_go = slope.head<4>() + line.feedback.transpose() * slope[4];
  }
}

// Calls use(k, u) for each line with the u of its law, off the grid. Returns the last g.
template <typename Use>
double apply_laws(const std::vector<Stage>& stages, Use use) {
  Eigen::Vector4d z = Eigen::Vector4d::Zero();
  for (std::size_t k = 0; k < stages.size(); ++k) {
    const Stage& line = stages[k];
    const double u = line.feedback * z + line.feed_forward;
    use(k, u);
    Vector5 w;
    w << z, u;
    z = line.move * w + line.shift;
  }
  return z[3];
}

// The median of the lines' curvatures.
double middle_curvature(const std::vector<Stage>& stages) {
  std::vector<double> curvatures;
  for (const Stage& line : stages) {
    curvatures.push_back(line.curvature);
  }
  const auto middle = curvatures.begin() + static_cast<std::ptrdiff_t>(curvatures.size() / 2);
  std::ranges::nth_element(curvatures, middle);
  return *middle;
}

// w and λ of one bounded quantity, which is a u or the last g.
struct Drawn {
  double w = 0.0;
  double lambda = 0.0;

  [[nodiscard]] double target() const { return w - lambda; }

  // One round of ADMM, for the new value of the quantity. Returns the larger of the change of w and
  // the distance between value and w.
  double draw(double value, const Bounds& bounds) {
    const double before = w;
    w = bounds.nearest(value + lambda);
    lambda += value - w;
    return std::max(std::abs(value - w), std::abs(w - before));
  }
};

// Sets the laws of all lines so that each u lies within its bounds, nearly.
void regulate(Ending& ending, std::vector<Stage>& stages) {
  set_feedback(ending, 0.0, stages);
  set_feed_forward(ending, 0.0, stages);
  bool within = true;
  const auto begin = [&](double value, const Bounds& bounds) {
    const Drawn drawn{bounds.nearest(value), 0.0};
    within = within && drawn.w == value;
    return drawn;
  };
  std::vector<Drawn> changes(stages.size());
  const double last =
      apply_laws(stages, [&](std::size_t k, double u) { changes[k] = begin(u, stages[k].bounds); });
  Drawn at_end = begin(last, ending.bounds);
  if (within) {
    return;
  }
  const double rho = kPull * middle_curvature(stages);
  set_feedback(ending, rho, stages);
  double change = std::numeric_limits<double>::infinity();
  for (int round = 0; round < kMostRounds && change > kSettled_mm_s; ++round) {
    for (std::size_t k = 0; k < stages.size(); ++k) {
      stages[k].target = changes[k].target();
    }
    ending.target = at_end.target();
    set_feed_forward(ending, rho, stages);
    change = 0.0;
    const double g = apply_laws(stages, [&](std::size_t k, double u) {
      change = std::max(change, changes[k].draw(u, stages[k].bounds));
    });
    change = std::max(change, at_end.draw(g, ending.bounds));
  }
}

// `reach`, widened to where the base itself goes.
Reach with_base(Reach reach, const BaseTrajectory& base, AxisAt axis) {
  for (std::size_t k = 0; k < base.nodes(); ++k) {
    const double at = (base.*axis)(static_cast<double>(k) * base.period_s).position_mm;
    reach.min_mm = std::min(reach.min_mm, at);
    reach.max_mm = std::max(reach.max_mm, at);
  }
  return reach;
}

// The speed of the base at time t, or 0 where it rests.
double speed_at(const BaseTrajectory& base, AxisAt axis, double t, bool rests) {
  return rests ? 0.0 : (base.*axis)(t).velocity_mm_s;
}

// Sets the bounds of each u and of the last g.
void set_bounds(const SpeedSteps& most, double before_mm_s, double after_mm_s, const Ends& ends,
                std::vector<Stage>& stages, Ending& ending) {
  // The bounds at the begin of line k, or at the end of the last line. The largest change of speed
  // is at least the base's own. If another part continues there, each side gets half.
  const auto bounds = [&](std::size_t k, double middles_s, bool shared, double own) {
    const double both = most.at_mm_s.empty()
                            ? std::min(most.step_mm_s, most.accel_mm_s2 * middles_s)
                            : most.at_mm_s[k];
    const double step = std::max(shared ? 0.5 * both : both, std::abs(own));
    return Bounds{-step - own, step - own};
  };
  for (std::size_t k = 0; k < stages.size(); ++k) {
    Stage& line = stages[k];
    const double own = line.chord_mm_s - (k > 0 ? stages[k - 1].chord_mm_s : before_mm_s);
    const double middles_s =
        k > 0 ? 0.5 * (stages[k - 1].duration_s + line.duration_s) : 0.5 * line.duration_s;
    line.bounds = bounds(k, middles_s, k == 0 && !ends.from_rest, own);
  }
  // g = v − c, and v may differ from the speed behind it by one step.
  const Stage& last = stages.back();
  ending.bounds =
      bounds(stages.size(), 0.5 * last.duration_s, !ends.to_rest, last.chord_mm_s - after_mm_s);
}

}  // namespace

double AxisGrid::nearest(double position_mm) const {
  return offset_mm + std::round((position_mm - offset_mm) / step_mm) * step_mm;
}

VertexChooser::VertexChooser(const BaseTrajectory& base, AxisAt axis, const FlexibleAxis& nozzle)
    : base_(&base), axis_(axis), nozzle_(nozzle), followed_(base, axis, nozzle) {}

AxisVertices VertexChooser::choose(const std::vector<double>& times, const AxisGrid& grid,
                                   const Reach& reach, const SpeedSteps& most, Ends ends) const {
  const BaseTrajectory& base = *base_;
  const AxisAt axis = axis_;
  const std::size_t lines = times.size() - 1;
  std::map<std::int64_t, StepMatrix> steps;  // by length; there are only a few lengths
  std::vector<Stage> stages;
  std::vector<double> on_curve = {(base.*axis)(0.0).position_mm};
  for (std::size_t k = 0; k < lines; ++k) {
    const double duration = times[k + 1] - times[k];
    const double dt = duration / std::ceil(duration / base.period_s - 1e-9);
    constexpr double kSame_s = 1e-12;
    const StepMatrix& step =
        steps.try_emplace(std::llround(dt / kSame_s), nozzle_, dt).first->second;
    stages.push_back(stage(base, axis, followed_, step, times[k], times[k + 1]));
    on_curve.push_back((base.*axis)(times[k + 1]).position_mm);
  }
  Ending ending;
  set_bounds(most, speed_at(base, axis, times.front(), ends.from_rest),
             speed_at(base, axis, times.back(), ends.to_rest), ends, stages, ending);
  const Reach within = with_base(reach, base, axis);
  // After the run e rings down.
  ending.cost.topLeftCorner<2, 2>() = ring_down_square(nozzle_);
  ending.cost(2, 2) = kAtEnd;
  regulate(ending, stages);
  // Chooses the vertices by the laws, or on the curve. The last line takes what is left. Returns
  // whether it and all other lines keep their bounds.
  const auto draw = [&](bool by_law, AxisVertices& result) {
    result = {{on_curve.front()}, {0.0}};
    Eigen::Vector4d z = Eigen::Vector4d::Zero();
    bool within_bounds = true;
    for (std::size_t k = 0; k < lines; ++k) {
      const Stage& line = stages[k];
      double vertex = on_curve[k + 1];
      if (k + 1 < lines) {
        if (by_law) {
          // We do not clamp each change to its bounds. The regulator would not know of that, and
          // what it misses on one line would grow on the next ones.
          const double change = line.feedback * z + line.feed_forward;
          vertex += z[2] + line.duration_s * (z[3] + change);
        }
        vertex = grid.nearest(std::clamp(vertex, within.min_mm, within.max_mm));
      }
      Vector5 w;
      w << z, (vertex - on_curve[k + 1] - z[2]) / line.duration_s - z[3];
      z = line.move * w + line.shift;
      const double rounding = grid.step_mm / line.duration_s;
      within_bounds = within_bounds && line.bounds.hold(w[4], rounding) &&
                      (k + 1 < lines || ending.bounds.hold(z[3], rounding));
      result.position_mm.push_back(vertex);
      result.nozzle_error_mm.push_back(z[0]);
    }
    return within_bounds;
  };
  AxisVertices result;
  if (!draw(true, result)) {
    draw(false, result);
  }
  return result;
}

}  // namespace unflex::emit
