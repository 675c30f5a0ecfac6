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
// cost. The last g is treated like a u. ADMM does not change the gains (O'Donoghue, Stathopoulos &
// Boyd, A splitting method for optimal control, IEEE Trans. Control Syst. Technol. 21, 2013). Where
// a bound is still broken by more than a little, the vertices stay on the curve.
//
// Lines with the same number of steps of the same length share M, H and the map from the chord to
// h.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "followed.hpp"
#include "unflex/dynamics/base_trajectory.hpp"
#include "unflex/dynamics/flexible_axis.hpp"

namespace unflex::emit::regulator {

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
inline constexpr double kAtEnd = 1e3;
// ADMM: the largest number of rounds, the change at which it ends, and ρ as a share of the cost of
// u without ρ.
inline constexpr int kMostRounds = 200;
inline constexpr double kSettled_mm_s = 0.02;
inline constexpr double kPull = 0.3;
// Lines are still worked on within this many lines of a line whose u still changes.
inline constexpr std::size_t kAround = 24;
// A change of speed may exceed its bounds by this share of their width: ADMM ends a little outside,
// and the last line, which ends where the base does, takes what is left.
inline constexpr double kOfBounds = 0.02;

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

// All lines with the same number of steps of one length share this: where they take (y, o), the
// cost of that, and how the slope of the cost follows from the chord's error at each step.
template <int kModes>
struct Shape {
  static constexpr int kAll = kOfAll<kModes>;
  Eigen::Matrix<double, kOfZ<kModes>, kAll> move =
      Eigen::Matrix<double, kOfZ<kModes>, kAll>::Zero();
  Square<kAll> cost = Square<kAll>::Zero();
  std::vector<Vector<kAll>> of_nozzle;
  std::vector<Vector<kAll>> of_base;
};

// One line: where it takes (y, o), and what it costs: ½ wᵀHw + hᵀw for w = (z, u).
template <int kModes>
struct Stage {
  static constexpr int kZ = kOfZ<kModes>;
  static constexpr int kAll = kOfAll<kModes>;
  const Shape<kModes>* shape = nullptr;
  Vector<kZ> shift = Vector<kZ>::Zero();
  Vector<kAll> slope = Vector<kAll>::Zero();
  double duration_s = 0.0;
  double chord_mm_s = 0.0;
  Bounds bounds;  // of u
  // The law u = feedback · z + feed_forward, and what is needed to find it.
  Eigen::Matrix<double, 1, kZ> feedback = Eigen::Matrix<double, 1, kZ>::Zero();
  double feed_forward = 0.0;
  double curvature = 0.0;                    // of the cost along u
  Vector<kAll> pull = Vector<kAll>::Zero();  // the cost's slope without the cost to go and w

  // Where the line leads from (z, u).
  [[nodiscard]] Vector<kZ> behind(const Vector<kZ>& z, double u) const {
    Vector<kAll> w;
    w << z, u;
    return shape->move * w + shift;
  }
};

// The cost and the bounds at the end of the last line.
template <int kModes>
struct Ending {
  Square<kOfZ<kModes>> cost = Square<kOfZ<kModes>>::Zero();
  Bounds bounds;  // of the last g
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
  // The effect of the base in a step.
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
Shape<kModes> shape_of(const Steps<kModes>& step, int steps) {
  constexpr int kY = kOfY<kModes>;
  constexpr int kEnds = kY + 2;  // (y, o_k, o_{k+1})
  constexpr int kAll = kOfAll<kModes>;
  using Row = Eigen::Matrix<double, 1, kEnds>;
  const double duration = steps * step.dt();
  // o_{k+1} = o_k + T (g_{k−1} + u)
  Eigen::Matrix<double, kEnds, kAll> of_speed = Eigen::Matrix<double, kEnds, kAll>::Zero();
  of_speed.template leftCols<kY + 1>().template topRows<kY + 1>().setIdentity();
  of_speed(kY + 1, kY) = 1.0;
  of_speed(kY + 1, kY + 1) = duration;
  of_speed(kY + 1, kY + 2) = duration;
  // The nozzle's answer to (y, o_k, o_{k+1}).
  Eigen::Matrix<double, kY, kEnds> answer = Eigen::Matrix<double, kY, kEnds>::Zero();
  answer.template leftCols<kY>().setIdentity();
  Square<kEnds> cost = Square<kEnds>::Zero();
  Shape<kModes> result;
  const auto add_square = [&](const Row& row, double weight, std::vector<Vector<kAll>>& slopes) {
    cost += weight * row.transpose() * row;
    slopes.push_back(weight * (row * of_speed).transpose());
  };
  for (int i = 0; i < steps; ++i) {
    const double s = static_cast<double>(i) / steps;
    step.advance(answer);
    answer.col(kY) += step.base(1.0 - s, -1.0 / duration);
    answer.col(kY + 1) += step.base(s, 1.0 / duration);
    Row of_nozzle = answer.row(0);
    for (int mode = 1; mode < kModes; ++mode) {
      of_nozzle += answer.row(2 * mode);
    }
    add_square(of_nozzle, step.dt(), result.of_nozzle);
    Row of_base = Row::Zero();
    of_base[kY + 1] = static_cast<double>(i + 1) / steps;
    of_base[kY] = 1.0 - of_base[kY + 1];
    add_square(of_base, kBaseWeight * step.dt(), result.of_base);
  }
  result.cost = of_speed.transpose() * cost * of_speed;
  result.move.template topRows<kY>() = answer * of_speed;
  result.move.row(kY) = of_speed.row(kY + 1);
  result.move(kY + 1, kY + 1) = 1.0;
  result.move(kY + 1, kY + 2) = 1.0;
  return result;
}

template <int kModes>
Stage<kModes> stage(const BaseTrajectory& base, std::size_t axis, const Followed& followed,
                    const Steps<kModes>& step, const Shape<kModes>& shape, double from, double to) {
  constexpr int kY = kOfY<kModes>;
  const double duration = to - from;
  const std::size_t steps = shape.of_nozzle.size();
  const double b0 = base.at(base[axis], from).position_mm;
  const double slope = (base.at(base[axis], to).position_mm - b0) / duration;
  Stage<kModes> result;
  // The nozzle's answer to the chord alone, and how far that is from the nozzle that follows b.
  Vector<kY> chord = vector_of<kModes>(followed.at(from)) - step.resting(b0);
  Vector<kY> off = Vector<kY>::Zero();
  for (std::size_t i = 0; i < steps; ++i) {
    const double s = static_cast<double>(i) / static_cast<double>(steps);
    const double end = static_cast<double>(i + 1) / static_cast<double>(steps);
    step.advance(chord);
    chord += step.base(slope * s * duration, slope);
    const double t = from + end * duration;
    off = chord - (vector_of<kModes>(followed.at(t)) - step.resting(b0));
    const double chord_off = slope * end * duration - (base.at(base[axis], t).position_mm - b0);
    result.slope += position_of(off) * shape.of_nozzle[i] + chord_off * shape.of_base[i];
  }
  result.shape = &shape;
  result.shift.template head<kY>() = off;
  result.duration_s = duration;
  result.chord_mm_s = slope;
  return result;
}

// The lines from `first` to before `behind`.
struct Stretch {
  std::size_t first = 0;
  std::size_t behind = 0;
};

// Sets the feedback of all laws for a pull of ρ towards the targets.
template <int kModes>
void set_feedback(const Ending<kModes>& ending, double rho, std::vector<Stage<kModes>>& stages) {
  constexpr int kZ = kOfZ<kModes>;
  Square<kZ> to_go = ending.cost;
  to_go(kZ - 1, kZ - 1) += rho;
  for (std::size_t k = stages.size(); k-- > 0;) {
    Stage<kModes>& line = stages[k];
    const auto& move = line.shape->move;
    Square<kOfAll<kModes>> cost = line.shape->cost + move.transpose() * to_go * move;
    cost(kZ, kZ) += rho;
    line.pull = line.slope + move.transpose() * (to_go * line.shift);
    line.curvature = cost(kZ, kZ);
    line.feedback = -cost.row(kZ).template head<kZ>() / cost(kZ, kZ);
    to_go =
        cost.template topLeftCorner<kZ, kZ>() + cost.col(kZ).template head<kZ>() * line.feedback;
  }
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

// Sets the laws of all lines so that each u lies within its bounds, nearly. The feedback of all
// laws is set at once. Then only lines near those whose u still changes are worked on, since the
// effect of u fades within the lines over which the nozzle rings.
template <int kModes>
class Regulator {
 public:
  Regulator(Ending<kModes>& ending, std::vector<Stage<kModes>>& stages)
      : ending_(ending),
        stages_(stages),
        drawn_(stages.size() + 1),
        to_go_(stages.size() + 1, State::Zero()),
        z_(stages.size() + 1, State::Zero()),
        moved_(stages.size() + 1, 0.0) {}

  void regulate() {
    const Stretch all{0, stages_.size()};
    set_feedback(ending_, 0.0, stages_);
    set_feed_forward(all, 0.0);
    bool within = true;
    apply_laws(all, [&](std::size_t k, double value) {
      drawn_[k] = {bounds_of(k).nearest(value), 0.0};
      within = within && drawn_[k].w == value;
    });
    if (within) {
      return;
    }
    const double rho = kPull * middle_curvature(stages_);
    set_feedback(ending_, rho, stages_);
    std::vector<Stretch> moving = {all};
    for (int round = 0; round < kMostRounds && !moving.empty(); ++round) {
      for (std::size_t i = moving.size(); i-- > 0;) {
        set_feed_forward(moving[i], rho);
      }
      for (const Stretch& stretch : moving) {
        apply_laws(stretch, [&](std::size_t k, double value) {
          moved_[k] = drawn_[k].draw(value, bounds_of(k));
        });
      }
      moving = around_moving(moving);
    }
  }

 private:
  static constexpr int kZ = kOfZ<kModes>;
  using State = Vector<kZ>;

  // Bounds of u on line k, or of the last g.
  [[nodiscard]] const Bounds& bounds_of(std::size_t k) const {
    return k < stages_.size() ? stages_[k].bounds : ending_.bounds;
  }

  // Sets the feed-forward of the laws, once the feedback is set.
  void set_feed_forward(const Stretch& stretch, double rho) {
    if (stretch.behind == stages_.size()) {
      to_go_.back()[kZ - 1] = -rho * drawn_.back().target();
    }
    State to_go = to_go_[stretch.behind];
    for (std::size_t k = stretch.behind; k-- > stretch.first;) {
      Stage<kModes>& line = stages_[k];
      Vector<kOfAll<kModes>> slope = line.pull + line.shape->move.transpose() * to_go;
      slope[kZ] -= rho * drawn_[k].target();
      line.feed_forward = -slope[kZ] / line.curvature;
      to_go = slope.template head<kZ>() + line.feedback.transpose() * slope[kZ];
      to_go_[k] = to_go;
    }
  }

  // Calls use(k, u) for each line with the u of its law, off the grid, and at the end of all lines
  // with the last g.
  template <typename Use>
  void apply_laws(const Stretch& stretch, Use use) {
    State z = z_[stretch.first];
    for (std::size_t k = stretch.first; k < stretch.behind; ++k) {
      const Stage<kModes>& line = stages_[k];
      const double u = line.feedback * z + line.feed_forward;
      use(k, u);
      z = line.behind(z, u);
      z_[k + 1] = z;
    }
    if (stretch.behind == stages_.size()) {
      use(stages_.size(), z[kZ - 1]);
    }
  }

  [[nodiscard]] std::vector<Stretch> around_moving(const std::vector<Stretch>& stretches) const {
    std::vector<Stretch> result;
    for (const Stretch& stretch : stretches) {
      const std::size_t ends = stretch.behind == stages_.size() ? 1 : 0;
      for (std::size_t k = stretch.first; k < stretch.behind + ends; ++k) {
        if (moved_[k] <= kSettled_mm_s) {
          continue;
        }
        const std::size_t first = std::max(stretch.first + kAround, k) - kAround;
        const std::size_t behind = std::min(stretch.behind, k + kAround + 1);
        if (!result.empty() && first <= result.back().behind) {
          result.back().behind = std::max(result.back().behind, behind);
        } else {
          result.push_back({first, behind});
        }
      }
    }
    return result;
  }

  Ending<kModes>& ending_;
  std::vector<Stage<kModes>>& stages_;
  // w and λ of u on each line, and of the last g.
  std::vector<Drawn> drawn_;
  std::vector<State> to_go_;   // slope of the cost to go, before each line and behind the last one
  std::vector<State> z_;       // there
  std::vector<double> moved_;  // by the last round, mm/s
};

}  // namespace unflex::emit::regulator
