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
#include <vector>

namespace unflex::emit {
namespace {

using dynamics::BaseTrajectory;
using dynamics::FlexibleAxis;

// Sizes by the number of modes: of y, of z, and of (z, u).
template <int kModes>
inline constexpr int kOfY = 2 * kModes;
template <int kModes>
inline constexpr int kOfZ = kOfY<kModes> + 2;
template <int kModes>
inline constexpr int kOfAll = kOfZ<kModes> + 1;

template <int kSize>
using Vector = Eigen::Matrix<double, kSize, 1>;
template <int kSize>
using Square = Eigen::Matrix<double, kSize, kSize>;

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
template <int kModes>
struct Stage {
  static constexpr int kZ = kOfZ<kModes>;
  static constexpr int kAll = kOfAll<kModes>;
  Eigen::Matrix<double, kZ, kAll> move = Eigen::Matrix<double, kZ, kAll>::Zero();
  Vector<kZ> shift = Vector<kZ>::Zero();
  Square<kAll> cost = Square<kAll>::Zero();
  Vector<kAll> slope = Vector<kAll>::Zero();
  double duration_s = 0.0;
  double chord_mm_s = 0.0;
  Bounds bounds;  // of u
  // The law u = feedback · z + feed_forward, and what is needed to find it.
  Eigen::Matrix<double, 1, kZ> feedback = Eigen::Matrix<double, 1, kZ>::Zero();
  double feed_forward = 0.0;
  double curvature = 0.0;                    // of the cost along u
  Vector<kAll> pull = Vector<kAll>::Zero();  // the cost's slope without the cost to go and w
  double target = 0.0;                       // w − λ
};

// The cost and the bounds at the end of the last line.
template <int kModes>
struct Ending {
  Square<kOfZ<kModes>> cost = Square<kOfZ<kModes>>::Zero();
  Bounds bounds;        // of the last g
  double target = 0.0;  // w − λ
};

// One step of the same length for each mode.
template <int kModes>
class Steps {
 public:
  Steps(const FlexibleAxis& nozzle, double dt) {
    for (std::size_t mode = 0; mode < kModes; ++mode) {
      of_mode_.emplace_back(nozzle, mode, dt);
    }
  }

  [[nodiscard]] double dt() const { return of_mode_.front().dt(); }
  // A step of states, one in each column, without the base.
  template <class Matrix>
  void advance(Matrix& states) const {
    for (Eigen::Index i = 0; i < kModes; ++i) {
      const Eigen::Matrix<double, 2, Matrix::ColsAtCompileTime> before =
          states.template middleRows<2>(2 * i);
      states.template middleRows<2>(2 * i) = of_mode_[static_cast<std::size_t>(i)].free() * before;
    }
  }
  // What the base does in a step.
  [[nodiscard]] Vector<kOfY<kModes>> base(double position, double velocity) const {
    Vector<kOfY<kModes>> result;
    for (Eigen::Index i = 0; i < kModes; ++i) {
      result.template segment<2>(2 * i) =
          of_mode_[static_cast<std::size_t>(i)].base(position, velocity);
    }
    return result;
  }
  // A nozzle that rests with the base at this place.
  [[nodiscard]] Vector<kOfY<kModes>> resting(double position) const {
    Vector<kOfY<kModes>> result;
    for (Eigen::Index i = 0; i < kModes; ++i) {
      result.template segment<2>(2 * i) << of_mode_[static_cast<std::size_t>(i)].gain() * position,
          0.0;
    }
    return result;
  }

 private:
  std::vector<StepMatrix> of_mode_;
};

template <int kModes>
Stage<kModes> stage(const BaseTrajectory& base, AxisAt axis, const Followed& followed,
                    const Steps<kModes>& step, double from, double to) {
  constexpr int kY = kOfY<kModes>;
  constexpr int kEnds = kY + 2;  // (y, o_k, o_{k+1})
  using State = Vector<kY>;
  const double duration = to - from;
  const int steps = static_cast<int>(std::lround(duration / step.dt()));
  const double b0 = (base.*axis)(from).position_mm;
  const double slope = ((base.*axis)(to).position_mm - b0) / duration;
  // First by where the line begins and ends, (y, o_k, o_{k+1}).
  Square<kEnds> cost = Square<kEnds>::Zero();
  Vector<kEnds> gradient = Vector<kEnds>::Zero();
  using Row = Eigen::Matrix<double, 1, kEnds>;
  const auto add_square = [&](const Row& row, double value, double weight) {
    cost += weight * row.transpose() * row;
    gradient += weight * value * row.transpose();
  };
  // The nozzle's answer to these, and to the chord alone.
  Eigen::Matrix<double, kY, kEnds> answer = Eigen::Matrix<double, kY, kEnds>::Zero();
  answer.template leftCols<kY>().setIdentity();
  State chord = vector_of<kModes>(followed.at(from)) - step.resting(b0);
  State off = State::Zero();
  for (int i = 0; i < steps; ++i) {
    const double s = static_cast<double>(i) / steps;
    step.advance(answer);
    answer.col(kY) += step.base(1.0 - s, -1.0 / duration);
    answer.col(kY + 1) += step.base(s, 1.0 / duration);
    step.advance(chord);
    chord += step.base(slope * s * duration, slope);
    const double end = s + 1.0 / steps;
    const double t = from + end * duration;
    off = chord - (vector_of<kModes>(followed.at(t)) - step.resting(b0));
    Row of_nozzle = answer.row(0);
    for (int mode = 1; mode < kModes; ++mode) {
      of_nozzle += answer.row(2 * mode);
    }
    add_square(of_nozzle, position_of(off), step.dt());
    const double chord_off = slope * end * duration - ((base.*axis)(t).position_mm - b0);
    Row of_base = Row::Zero();
    of_base[kY] = 1.0 - end;
    of_base[kY + 1] = end;
    add_square(of_base, chord_off, kBaseWeight * step.dt());
  }
  // o_{k+1} = o_k + T (g_{k−1} + u)
  Eigen::Matrix<double, kEnds, kOfAll<kModes>> of_speed =
      Eigen::Matrix<double, kEnds, kOfAll<kModes>>::Zero();
  of_speed.template leftCols<kY + 1>().template topRows<kY + 1>().setIdentity();
  of_speed(kY + 1, kY) = 1.0;
  of_speed(kY + 1, kY + 1) = duration;
  of_speed(kY + 1, kY + 2) = duration;
  Stage<kModes> result;
  result.cost = of_speed.transpose() * cost * of_speed;
  result.slope = of_speed.transpose() * gradient;
  result.move.template topRows<kY>() = answer * of_speed;
  result.move.row(kY) = of_speed.row(kY + 1);
  result.move(kY + 1, kY + 1) = 1.0;
  result.move(kY + 1, kY + 2) = 1.0;
  result.shift.template head<kY>() = off;
  result.duration_s = duration;
  result.chord_mm_s = slope;
  return result;
}

// Sets the feedback of all laws for a pull of ρ towards the targets.
template <int kModes>
void set_feedback(const Ending<kModes>& ending, double rho, std::vector<Stage<kModes>>& stages) {
  constexpr int kZ = kOfZ<kModes>;
  Square<kZ> to_go = ending.cost;
  to_go(kZ - 1, kZ - 1) += rho;
  for (std::size_t k = stages.size(); k-- > 0;) {
    Stage<kModes>& line = stages[k];
    Square<kOfAll<kModes>> cost = line.cost + line.move.transpose() * to_go * line.move;
    cost(kZ, kZ) += rho;
    line.pull = line.slope + line.move.transpose() * (to_go * line.shift);
    line.curvature = cost(kZ, kZ);
    line.feedback = -cost.row(kZ).template head<kZ>() / cost(kZ, kZ);
    to_go =
        cost.template topLeftCorner<kZ, kZ>() + cost.col(kZ).template head<kZ>() * line.feedback;
  }
}

// Sets the feed-forward of all laws, once the feedback is set.
template <int kModes>
void set_feed_forward(const Ending<kModes>& ending, double rho,
                      std::vector<Stage<kModes>>& stages) {
  constexpr int kZ = kOfZ<kModes>;
  Vector<kZ> to_go = Vector<kZ>::Zero();
  to_go[kZ - 1] = -rho * ending.target;
  for (std::size_t k = stages.size(); k-- > 0;) {
    Stage<kModes>& line = stages[k];
    Vector<kOfAll<kModes>> slope = line.pull + line.move.transpose() * to_go;
    slope[kZ] -= rho * line.target;
    line.feed_forward = -slope[kZ] / line.curvature;
    to_go = slope.template head<kZ>() + line.feedback.transpose() * slope[kZ];
  }
}

// Calls use(k, u) for each line with the u of its law, off the grid. Returns the last g.
template <int kModes, typename Use>
double apply_laws(const std::vector<Stage<kModes>>& stages, Use use) {
  constexpr int kZ = kOfZ<kModes>;
  Vector<kZ> z = Vector<kZ>::Zero();
  for (std::size_t k = 0; k < stages.size(); ++k) {
    const Stage<kModes>& line = stages[k];
    const double u = line.feedback * z + line.feed_forward;
    use(k, u);
    Vector<kOfAll<kModes>> w;
    w << z, u;
    z = line.move * w + line.shift;
  }
  return z[kZ - 1];
}

// The median of the lines' curvatures.
template <int kModes>
double middle_curvature(const std::vector<Stage<kModes>>& stages) {
  std::vector<double> curvatures;
  for (const Stage<kModes>& line : stages) {
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
template <int kModes>
void regulate(Ending<kModes>& ending, std::vector<Stage<kModes>>& stages) {
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
template <int kModes>
void set_bounds(const SpeedSteps& most, double before_mm_s, double after_mm_s, const Ends& ends,
                std::vector<Stage<kModes>>& stages, Ending<kModes>& ending) {
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
    Stage<kModes>& line = stages[k];
    const double own = line.chord_mm_s - (k > 0 ? stages[k - 1].chord_mm_s : before_mm_s);
    const double middles_s =
        k > 0 ? 0.5 * (stages[k - 1].duration_s + line.duration_s) : 0.5 * line.duration_s;
    line.bounds = bounds(k, middles_s, k == 0 && !ends.from_rest, own);
  }
  // g = v − c, and v may differ from the speed behind it by one step.
  const Stage<kModes>& last = stages.back();
  ending.bounds =
      bounds(stages.size(), 0.5 * last.duration_s, !ends.to_rest, last.chord_mm_s - after_mm_s);
}

template <int kModes>
AxisVertices choose_vertices(const BaseTrajectory& base, AxisAt axis, const FlexibleAxis& nozzle,
                             const Followed& followed, const std::vector<double>& times,
                             const AxisGrid& grid, const Reach& reach, const SpeedSteps& most,
                             Ends ends) {
  constexpr int kZ = kOfZ<kModes>;
  const std::size_t lines = times.size() - 1;
  std::map<std::int64_t, Steps<kModes>> steps;  // by length; there are only a few lengths
  std::vector<Stage<kModes>> stages;
  std::vector<double> on_curve = {(base.*axis)(0.0).position_mm};
  for (std::size_t k = 0; k < lines; ++k) {
    const double duration = times[k + 1] - times[k];
    const double dt = duration / std::ceil(duration / base.period_s - 1e-9);
    constexpr double kSame_s = 1e-12;
    const Steps<kModes>& step =
        steps.try_emplace(std::llround(dt / kSame_s), nozzle, dt).first->second;
    stages.push_back(stage(base, axis, followed, step, times[k], times[k + 1]));
    on_curve.push_back((base.*axis)(times[k + 1]).position_mm);
  }
  Ending<kModes> ending;
  set_bounds(most, speed_at(base, axis, times.front(), ends.from_rest),
             speed_at(base, axis, times.back(), ends.to_rest), ends, stages, ending);
  const Reach within = with_base(reach, base, axis);
  // After the run e rings down.
  ending.cost.template topLeftCorner<kZ - 2, kZ - 2>() = ring_down_square<kModes>(nozzle);
  ending.cost(kZ - 2, kZ - 2) = kAtEnd;
  regulate(ending, stages);
  // Chooses the vertices by the laws, or on the curve. The last line takes what is left. Returns
  // whether it and all other lines keep their bounds.
  const auto draw = [&](bool by_law, AxisVertices& result) {
    result = {{on_curve.front()}, {0.0}};
    Vector<kZ> z = Vector<kZ>::Zero();
    bool within_bounds = true;
    for (std::size_t k = 0; k < lines; ++k) {
      const Stage<kModes>& line = stages[k];
      double vertex = on_curve[k + 1];
      if (k + 1 < lines) {
        if (by_law) {
          // We do not clamp each change to its bounds. The regulator would not know of that, and
          // what it misses on one line would grow on the next ones.
          const double change = line.feedback * z + line.feed_forward;
          vertex += z[kZ - 2] + line.duration_s * (z[kZ - 1] + change);
        }
        vertex = grid.nearest(std::clamp(vertex, within.min_mm, within.max_mm));
      }
      Vector<kOfAll<kModes>> w;
      w << z, (vertex - on_curve[k + 1] - z[kZ - 2]) / line.duration_s - z[kZ - 1];
      z = line.move * w + line.shift;
      const double rounding = grid.step_mm / line.duration_s;
      within_bounds = within_bounds && line.bounds.hold(w[kZ], rounding) &&
                      (k + 1 < lines || ending.bounds.hold(z[kZ - 1], rounding));
      result.position_mm.push_back(vertex);
      result.nozzle_error_mm.push_back(position_of(z.template head<kZ - 2>()));
    }
    return within_bounds;
  };
  AxisVertices result;
  if (!draw(true, result)) {
    draw(false, result);
  }
  return result;
}

}  // namespace

double AxisGrid::nearest(double position_mm) const {
  return offset_mm + std::round((position_mm - offset_mm) / step_mm) * step_mm;
}

VertexChooser::VertexChooser(const BaseTrajectory& base, AxisAt axis, const FlexibleAxis& nozzle)
    : base_(&base), axis_(axis), nozzle_(nozzle), followed_(base, axis, nozzle) {}

AxisVertices VertexChooser::choose(const std::vector<double>& times, const AxisGrid& grid,
                                   const Reach& reach, const SpeedSteps& most, Ends ends) const {
  const auto choose = [&](auto modes) {
    return choose_vertices<decltype(modes)::value>(*base_, axis_, nozzle_, followed_, times, grid,
                                                   reach, most, ends);
  };
  return with_modes(nozzle_.mode_count(), choose);
}

}  // namespace unflex::emit
