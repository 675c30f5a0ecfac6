// The window with one unknown per node and no equality constraints.
//
// The chain of axis_chain.hpp has one input, so it has a flat output: a sequence c of nodes + 4
// numbers with
//
//   z_k = Σ_{i=0..4} v_i c_{k+i}        j_k = Σ_{i=0..5} d_i c_{k+i}
//
// where Σ v_i qⁱ = adj(qI − Φ) B and d is the characteristic polynomial of Φ (Faddeev–LeVerrier;
// Gantmacher, "The Theory of Matrices", IV.5). Everything that the cost and the limits speak of is
// then a short stencil on c, and the Hessian has half-bandwidth 5. c is scaled so that a resting
// axis has c = p = b.
//
// Fixed ends: p, ṗ, b, ḃ at the first node leave c_0 … c_4 = c* + m s with one unknown s, which
// stands in c_4's place; b and ḃ at the last node give the last two c from the three before them.
// Neither widens the band.
//
// All costs below are half of the window's, as are forces and multipliers.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>

#include "axis_chain.hpp"
#include "banded_ldlt.hpp"
#include "padded.hpp"

namespace unflex::compensate {

// Coefficients of c_k … c_{k+5}.
using Stencil = std::array<double, kHalfBand + 1>;

struct FlatStencils {
  std::array<Stencil, 5> state{};  // v: p, ṗ, b, ḃ, b̈; the last coefficient is 0
  Stencil jerk{};                  // d
  Stencil middle{};                // nozzle in the middle of the interval

  explicit FlatStencils(const AxisChain& chain);

  [[nodiscard]] const Stencil& of(RowKind kind) const;
};

class FlatForm {
 public:
  // Whether the axis is one model of one mode.
  [[nodiscard]] static bool takes(const AxisWindow& window);
  // Whether the window is long enough for its two ends not to meet, and ωh large enough for the
  // numbers, which grow by (ωh)⁻² from p to b̈ and back.
  [[nodiscard]] static bool suits(const ScaledWindow& window);

  // Takes the window, which must outlive the form, and goes to a first guess that keeps its ends.
  void assign(const ScaledWindow& window);
  // Takes the window's aims anew; the matrix stays.
  void set_aims();

  // Computes half the cost and half its gradient at the present c, and the values of the rows of
  // these kinds.
  void evaluate(const PerKind<bool>& kinds);
  [[nodiscard]] double half_cost() const;
  [[nodiscard]] const double* rows(RowKind kind) const { return rows_[index_of(kind)].data(); }

  // Prepares for steps: factorises the Hessian plus Gᵀ W G, where W weights the rows (null: no
  // weight). Returns false if it is not positive definite.
  [[nodiscard]] bool factor(const PerKind<const double*>& weights);

  // Finds the step to the minimum of the quadratic model less the work of the forces on the rows
  // (null: no forces), and the change of the rows by that step.
  void solve(const PerKind<const double*>& forces);
  [[nodiscard]] const double* row_steps(RowKind kind) const {
    return row_steps_[index_of(kind)].data();
  }
  // By how much the full step lowers the model.
  [[nodiscard]] double decrement() const { return decrement_; }

  // Makes the share `length` of the step.
  void advance(double length);

  void save() { saved_ = c_; }
  void restore() { c_ = saved_; }

  // There are no equations between the unknowns.
  [[nodiscard]] ProblemSize size() const { return {last_ - first_ + 1, 0}; }

  void write(dynamics::AxisTrajectory& base);
  // p of the only model at the nodes.
  void write_nozzles(std::vector<std::vector<double>>& nozzles_mm);

 private:
  // The weights of (p − r)² at nodes, or at middles.
  struct Tracked {
    Padded reference;
    Padded weight;
    Padded pull;  // weight times p − r
  };

  void find_ends();
  void keep_ends();
  void add_up_cost();
  void tie_ends_of_hessian();

  const ScaledWindow* window_ = nullptr;
  std::size_t nodes_ = 0;
  std::size_t first_ = 0;  // unknowns: c_first … c_last
  std::size_t last_ = 0;
  PerKind<Stencil> stencils_{};
  Stencil nozzle_{};
  Stencil middle_{};
  Eigen::Matrix<double, 5, 1> start_direction_;  // m
  Eigen::Matrix<double, 2, 3> end_from_;         // the last two c by the three before them

  Padded c_;
  Padded saved_;
  Padded step_;
  Padded gradient_;
  Tracked at_nodes_;
  Tracked at_middles_;
  Padded jerk_pull_;  // ρ j
  double half_cost_ = 0.0;
  double decrement_ = 0.0;
  double faint_pull_ = 0.0;
  PerKind<Padded> rows_;
  PerKind<Padded> row_steps_;
  Padded scratch_;
  BandMatrix cost_hessian_;
  BandMatrix hessian_;
  BandedLdlt ldlt_;
};

}  // namespace unflex::compensate
