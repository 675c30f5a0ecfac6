// The effect of a line of given duration on the nozzle, as a quadratic of where the line begins and
// ends.
//
// Notation:
//   τ_k        candidate times of line ends; b_k, f_k  base and nozzle state there
//   e          state of the nozzle that follows the lines, minus f: (e_1, ė_1, …) over the modes
//   o_k        a line's end at τ_k, minus b_k
//   z          (e_x, o_x, e_y, o_y) at the line's begin
//   u          (o_x, o_y) at its end
//   w          (z, u)
//   J          ½ ∫ pᵀWp + ε|d|² dt, p being the places of e, and d the line minus the base
//
// Whole steps leave errors that a line cannot avoid. Those near the resonance can cancel each other
// for one frequency only. So two nozzles follow the lines where frequencies may be off: one swings
// slower, the other faster, and pᵀWp is the mean of both. e holds first all modes of one nozzle,
// then all of the other.
//
// Both axes have kModes modes, of all nozzles together. An axis that has fewer gets modes that
// never move.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <functional>
#include <vector>

#include "followed.hpp"
#include "step_path.hpp"

namespace unflex::emit {

// Sizes by the number of modes: of one axis' part of z, of z, and of w.
template <int kModes>
inline constexpr int kOfAxis = 2 * kModes + 1;
template <int kModes>
inline constexpr int kOfZ = 2 * kOfAxis<kModes>;
template <int kModes>
inline constexpr int kOfW = kOfZ<kModes> + 2;

template <int kModes>
using ZVector = Eigen::Matrix<double, kOfZ<kModes>, 1>;
template <int kModes>
using ZMatrix = Eigen::Matrix<double, kOfZ<kModes>, kOfZ<kModes>>;
template <int kModes>
using WVector = Eigen::Matrix<double, kOfW<kModes>, 1>;
template <int kModes>
using WMatrix = Eigen::Matrix<double, kOfW<kModes>, kOfW<kModes>>;

// The place of o in z, of X and of Y.
template <int kModes>
[[nodiscard]] constexpr Eigen::Index place_of_o(std::size_t axis) {
  return static_cast<Eigen::Index>(axis) * kOfAxis<kModes> + 2 * kModes;
}

// ½ zᵀPz + pᵀz + c.
template <int kModes>
struct Quadratic {
  ZMatrix<kModes> matrix = ZMatrix<kModes>::Zero();
  ZVector<kModes> slope = ZVector<kModes>::Zero();
  double constant = 0.0;

  [[nodiscard]] double at(const ZVector<kModes>& z) const {
    return z.dot(0.5 * (matrix * z) + slope) + constant;
  }
};

// A line from τ_k to τ_{k+m}: J = ½ wᵀHw + hᵀw + c, z' = Mw + m.
template <int kModes>
struct LineCost {
  using Move = Eigen::Matrix<double, kOfZ<kModes>, kOfW<kModes>>;
  WMatrix<kModes> matrix = WMatrix<kModes>::Zero();
  WVector<kModes> slope = WVector<kModes>::Zero();
  double constant = 0.0;
  Move move = Move::Zero();
  ZVector<kModes> shift = ZVector<kModes>::Zero();
};

// The cost of a line and all that comes after it, by z and u:
// value(z) + ½ (u − u*)ᵀ S (u − u*), u* = feedback z + feed_forward.
template <int kModes>
struct LineChoice {
  using Feedback = Eigen::Matrix<double, 2, kOfZ<kModes>>;
  Quadratic<kModes> value;
  Eigen::Matrix2d stiffness = Eigen::Matrix2d::Zero();
  Feedback feedback = Feedback::Zero();
  Eigen::Vector2d feed_forward = Eigen::Vector2d::Zero();
};

// The cost of a line and all that comes after it: ½ wᵀHw + hᵀw + c.
template <int kModes>
struct WholeCost {
  WMatrix<kModes> matrix;
  WVector<kModes> slope;
  double constant = 0.0;
};

template <int kModes>
[[nodiscard]] WholeCost<kModes> whole_cost(const LineCost<kModes>& line,
                                           const Quadratic<kModes>& to_go);
template <int kModes>
[[nodiscard]] LineChoice<kModes> best_end(const LineCost<kModes>& line,
                                          const Quadratic<kModes>& to_go);
// The cost by z of a line that ends on the base (u = 0), and all that comes after it.
template <int kModes>
[[nodiscard]] Quadratic<kModes> ending_on_base(const LineCost<kModes>& line,
                                               const Quadratic<kModes>& to_go);

// Responses of the modes on one axis after j candidate intervals: to their own state, and to a step
// and a ramp of the base.
template <int kModes>
struct NozzleAnswers {
  // How the state of each mode follows from its own state: one block of 2 × 2 beside the other.
  using Free = Eigen::Matrix<double, 2, 2 * kModes>;
  std::vector<Free> free;
  std::vector<ModesVector<kModes>> step;
  std::vector<ModesVector<kModes>> ramp;

  [[nodiscard]] ModesVector<kModes> after(std::size_t j, const ModesVector<kModes>& state) const {
    ModesVector<kModes> result;
    for (Eigen::Index i = 0; i < kModes; ++i) {
      result.template segment<2>(2 * i) =
          free[j].template middleCols<2>(2 * i) * state.template segment<2>(2 * i);
    }
    return result;
  }
};

[[nodiscard]] inline Eigen::Vector2d vector(const XY& xy) { return {xy.x, xy.y}; }
// One member of the value of each axis.
template <typename T>
[[nodiscard]] Eigen::Vector2d of_axes(const Axes<T>& values, double T::*member) {
  return vector(map_axes([&](const T& value) { return value.*member; }, values));
}

// The candidate times, equally spaced, and the base there.
class Candidates {
 public:
  Candidates(const dynamics::BaseTrajectory& base,
             const std::function<ErrorWeight(double)>& weight);

  // Number of candidate times.
  [[nodiscard]] std::size_t size() const { return base_.size(); }
  [[nodiscard]] double time_s(std::size_t k) const { return static_cast<double>(k) * dt_s_; }
  // Time between two candidates.
  [[nodiscard]] double dt_s() const { return dt_s_; }
  // The fewest candidate intervals that last at least this long.
  [[nodiscard]] std::size_t candidates(double duration_s) const;
  [[nodiscard]] const Eigen::Vector2d& base_mm(std::size_t k) const { return base_[k]; }
  [[nodiscard]] const ErrorWeight& weight(std::size_t k) const { return weights_[k]; }

 private:
  double dt_s_;
  std::vector<Eigen::Vector2d> base_;
  std::vector<ErrorWeight> weights_;
};

// The costs of lines between candidates.
template <int kModes>
class LineCosts : public Candidates {
 public:
  LineCosts(const dynamics::BaseTrajectory& base, const std::function<ErrorWeight(double)>& weight,
            const LineRules& rules);

  // How many nozzles follow the lines.
  [[nodiscard]] std::size_t nozzles() const { return axes_[0].models.size(); }
  // The entries of a state that belong to a nozzle: the first, and the one behind the last.
  [[nodiscard]] std::pair<std::size_t, std::size_t> entries(std::size_t nozzle) const {
    return {2 * nozzle * modes_each_, 2 * (nozzle + 1) * modes_each_};
  }
  // The place of a nozzle in this state: the sum of its modes' places.
  [[nodiscard]] double place(std::size_t nozzle, const ModesVector<kModes>& state) const {
    auto [i, end] = entries(nozzle);
    double sum = state[i];
    for (i += 2; i < end; i += 2) {
      sum += state[i];
    }
    return sum;
  }
  // f of one axis at candidate k.
  [[nodiscard]] const ModesVector<kModes>& nozzle(std::size_t axis, std::size_t k) const {
    return axes_[axis].at[k];
  }
  // Nozzles that go along with the base.
  [[nodiscard]] ModesVector<kModes> riding(std::size_t axis, double position_mm,
                                           double velocity_mm_s = 0.0) const;
  // The gain of a mode; 0 if the axis does not have it.
  [[nodiscard]] double gain(std::size_t axis, std::size_t mode) const {
    const auto modes = axes_[axis].models[mode / modes_each_].modes();
    return mode % modes_each_ < modes.size() ? modes[mode % modes_each_].gain : 0.0;
  }
  [[nodiscard]] const NozzleAnswers<kModes>& answers(std::size_t axis) const {
    return axes_[axis].answers;
  }

  // The line from candidate k to k + m. k + m < size(), and the line lasts no longer than
  // rules.max_line_s.
  [[nodiscard]] LineCost<kModes> line(std::size_t k, std::size_t m) const;

  // The kick that the lead of a line (planner::PlannedMove::lead_s) adds to z at the line's end.
  // The line has `steps` steps at speed_mm_s, and comes after a line at before_mm_s. It lasts no
  // longer than rules.max_line_s.
  [[nodiscard]] ZVector<kModes> lead_kick(double line_s, double steps,
                                          const Eigen::Vector2d& speed_mm_s,
                                          double before_mm_s) const;

  // The cost after the last candidate: the base rests and e rings down.
  [[nodiscard]] Quadratic<kModes> ring_down() const;

 private:
  // Coefficients of (e, o, u) of one axis.
  static constexpr int kRow = kOfAxis<kModes> + 1;
  using Row = Eigen::Matrix<double, 1, kRow>;
  using RowSquare = Eigen::Matrix<double, kRow, kRow>;
  // The nozzles' places on the axes by (e, o, u) at some moments, and the sums of their squares.
  // All lines over m candidates share them.
  struct Look {
    std::size_t j = 0;       // candidates since the line's begin
    double s = 0.0;          // j as a share of the line
    std::size_t nozzle = 0;  // which of them
    Row x;
    Row y;
  };
  struct Shape {
    std::vector<Look> looks;  // all nozzles at one moment, one after the other
    double between_s = 0.0;   // time between two moments
    RowSquare xx = RowSquare::Zero();
    RowSquare xy = RowSquare::Zero();
    RowSquare yy = RowSquare::Zero();
    RowSquare base = RowSquare::Zero();
  };
  [[nodiscard]] Shape shape(std::size_t m) const;

  // The motion that the chord from b_k to b_{k+m} alone would make.
  struct Chord {
    double duration_s = 0.0;
    std::array<ModesVector<kModes>, 2> begin;  // nozzles relative to b_k
    std::array<double, 2> speed_mm_s{};
  };
  [[nodiscard]] Chord chord(std::size_t k, std::size_t m) const;

  // How far the chord's motion is from the nozzle and from the base at a look.
  struct Off {
    std::array<double, 2> nozzle_mm{};
    std::array<double, 2> base_mm{};
  };
  [[nodiscard]] Off off_at(const Look& look, const Chord& chord, std::size_t k) const;

  // J by (e, o, u) of both axes.
  struct RowSums {
    RowSquare xx;
    RowSquare xy = RowSquare::Zero();
    RowSquare yy;
    Row slope_x = Row::Zero();
    Row slope_y = Row::Zero();
    double constant = 0.0;
  };
  void add_looks(std::size_t k, std::size_t m, const Chord& chord, RowSums& sums) const;
  // share_s: the time that the look stands for.
  static void add_off(const Look& look, const Off& off, const ErrorWeight& w, double share_s,
                      RowSums& sums);
  // Writes H, h and c.
  static void write_cost(const RowSums& sums, LineCost<kModes>& result);
  // Writes M and m.
  void write_move(std::size_t k, std::size_t m, const Chord& chord, LineCost<kModes>& result) const;

  struct Axis {
    std::vector<dynamics::FlexibleAxis> models;  // one for each nozzle
    std::vector<ModesVector<kModes>> at;         // f
    NozzleAnswers<kModes> answers;
    ModesVector<kModes> riding_at_1_mm = ModesVector<kModes>::Zero();
    ModesVector<kModes> riding_at_1_mm_s = ModesVector<kModes>::Zero();
  };
  // One state of each nozzle as a vector.
  template <class StateOfNozzle>
  [[nodiscard]] ModesVector<kModes> beside_each_other(StateOfNozzle state_of_nozzle) const;

  std::array<Axis, 2> axes_;
  std::size_t modes_each_ = kModes;  // of one nozzle
  std::vector<std::size_t> same_weight_until_;
  std::vector<Shape> shapes_;  // by m
};

// Two nozzles follow the lines if frequencies may be off.
[[nodiscard]] inline std::size_t nozzles_for(const LineRules& rules) {
  return rules.freq_error > 0.0 ? 2 : 1;
}

extern template class LineCosts<1>;
extern template class LineCosts<2>;
extern template class LineCosts<3>;
extern template class LineCosts<4>;
extern template class LineCosts<6>;

}  // namespace unflex::emit
