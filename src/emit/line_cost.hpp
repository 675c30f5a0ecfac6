// The effect of a line of given duration on the nozzle, as a quadratic of where the line begins and
// ends.
//
// Notation:
//   τ_k        candidate times of line ends; b_k, f_k  base and nozzle state (p, ṗ) there
//   e          state of the nozzle that follows the lines, minus f
//   o_k        a line's end at τ_k, minus b_k
//   z          (e_x, ė_x, o_x, e_y, ė_y, o_y) at the line's begin
//   u          (o_x, o_y) at its end
//   w          (z, u)
//   J          ½ ∫ eᵀWe + ε|d|² dt, d being the line minus the base
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "followed.hpp"
#include "step_path.hpp"

namespace unflex::emit {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Vector8d = Eigen::Matrix<double, 8, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Matrix8d = Eigen::Matrix<double, 8, 8>;

// ½ zᵀPz + pᵀz + c.
struct Quadratic {
  Matrix6d matrix = Matrix6d::Zero();
  Vector6d slope = Vector6d::Zero();
  double constant = 0.0;

  [[nodiscard]] double at(const Vector6d& z) const {
    return z.dot(0.5 * (matrix * z) + slope) + constant;
  }
};

// A line from τ_k to τ_{k+m}: J = ½ wᵀHw + hᵀw + c, z' = Mw + m.
struct LineCost {
  Matrix8d matrix = Matrix8d::Zero();
  Vector8d slope = Vector8d::Zero();
  double constant = 0.0;
  Eigen::Matrix<double, 6, 8> move = Eigen::Matrix<double, 6, 8>::Zero();
  Vector6d shift = Vector6d::Zero();
};

// The cost of a line and all that comes after it, by z and u:
// value(z) + ½ (u − u*)ᵀ S (u − u*), u* = feedback z + feed_forward.
struct LineChoice {
  Quadratic value;
  Eigen::Matrix2d stiffness = Eigen::Matrix2d::Zero();
  Eigen::Matrix<double, 2, 6> feedback = Eigen::Matrix<double, 2, 6>::Zero();
  Eigen::Vector2d feed_forward = Eigen::Vector2d::Zero();
};

// The cost of a line and all that comes after it: ½ wᵀHw + hᵀw + c.
struct WholeCost {
  Matrix8d matrix;
  Vector8d slope;
  double constant = 0.0;
};

[[nodiscard]] WholeCost whole_cost(const LineCost& line, const Quadratic& to_go);
[[nodiscard]] LineChoice best_end(const LineCost& line, const Quadratic& to_go);
// The cost by z of a line that ends on the base (u = 0), and all that comes after it.
[[nodiscard]] Quadratic ending_on_base(const LineCost& line, const Quadratic& to_go);

// Responses of the nozzle on one axis after j candidate intervals: to its own state, and to a step
// and a ramp of the base.
struct NozzleAnswers {
  std::vector<Eigen::Matrix2d> free;
  std::vector<Eigen::Vector2d> step;
  std::vector<Eigen::Vector2d> ramp;
};

// The candidate times, equally spaced, and what lines between them cost.
class LineCosts {
 public:
  LineCosts(const dynamics::BaseTrajectory& base, const std::function<ErrorWeight(double)>& weight,
            const LineRules& rules);

  // Number of candidate times.
  [[nodiscard]] std::size_t size() const { return base_.size(); }
  [[nodiscard]] double time_s(std::size_t k) const { return static_cast<double>(k) * dt_s_; }
  // Time between two candidates.
  [[nodiscard]] double dt_s() const { return dt_s_; }
  // The fewest candidate intervals that last at least this long.
  [[nodiscard]] std::size_t candidates(double duration_s) const;
  [[nodiscard]] const Eigen::Vector2d& base_mm(std::size_t k) const { return base_[k]; }
  // f of one axis at candidate k.
  [[nodiscard]] const Eigen::Vector2d& nozzle(std::size_t axis, std::size_t k) const {
    return axis == 0 ? nozzle_x_at_[k] : nozzle_y_at_[k];
  }
  [[nodiscard]] const ErrorWeight& weight(std::size_t k) const { return weights_[k]; }
  [[nodiscard]] const NozzleAnswers& answers(std::size_t axis) const { return axis == 0 ? x_ : y_; }

  // The line from candidate k to k + m. k + m < size(), and the line lasts no longer than
  // rules.max_line_s.
  [[nodiscard]] LineCost line(std::size_t k, std::size_t m) const;

  // What the lead of a line (planner::PlannedMove::lead_s) adds to z at the line's end, for a line
  // of `steps` steps at speed_mm_s behind one at before_mm_s. The line lasts no longer than
  // rules.max_line_s.
  [[nodiscard]] Vector6d lead_kick(double line_s, double steps, const Eigen::Vector2d& speed_mm_s,
                                   double before_mm_s) const;

  // The cost after the last candidate: the base rests and e rings down.
  [[nodiscard]] Quadratic ring_down() const;

 private:
  using Row = Eigen::RowVector4d;
  // What all lines over m candidates share: e of an axis by (e, ė, o, u) at some moments, and the
  // sums of its squares.
  struct Shape {
    struct Look {
      std::size_t j = 0;  // candidates since the line's begin
      double s = 0.0;     // j as a share of the line
      Row x;
      Row y;
    };
    std::vector<Look> looks;
    Eigen::Matrix4d xx = Eigen::Matrix4d::Zero();
    Eigen::Matrix4d xy = Eigen::Matrix4d::Zero();
    Eigen::Matrix4d yy = Eigen::Matrix4d::Zero();
    Eigen::Matrix4d base = Eigen::Matrix4d::Zero();
  };
  [[nodiscard]] Shape shape(std::size_t m) const;

  dynamics::FlexibleAxis nozzle_x_;
  dynamics::FlexibleAxis nozzle_y_;
  double dt_s_;
  std::vector<Eigen::Vector2d> base_;
  std::vector<Eigen::Vector2d> nozzle_x_at_;  // f
  std::vector<Eigen::Vector2d> nozzle_y_at_;
  std::vector<ErrorWeight> weights_;
  std::vector<std::size_t> same_weight_until_;
  NozzleAnswers x_;
  NozzleAnswers y_;
  std::vector<Shape> shapes_;  // by m
};

}  // namespace unflex::emit
