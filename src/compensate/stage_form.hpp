// The window stage by stage: states z_k and inputs j_k, stepped by a Riccati recursion. It is
// several times the work of the flat form (flat_form.hpp), but takes any window: of two nodes, of
// any ωh, axes of several modes, any number of models of the axis (AxisWindow::plants), and
// frequencies that change within the window (AxisWindow::freq_shares).
//
// Notation, beside that of axis_chain.hpp:
//   c           models
//   y_i         how far a mode whose gain is 1 is ahead of the base (shared_modes.hpp)
//   z           (y_1, …, y_K, ẏ_1, …, ẏ_K, b, ḃ, b̈)
//   g_ci        gain of a mode in a model; p_c = b + Σ g_ci y_i
//
// A base that moves evenly takes all modes along, so y depends on its acceleration alone:
//
//   (y_i, ẏ_i)' = A_i (y_i, ẏ_i) + a_i b̈ + β_i j      b' = b + ḃ + b̈/2 + j/6      …
//
// Φ is then four diagonals and one column, a, so that Φᵀ P Φ costs a few n² multiplications instead
// of 2 n³. What is done at each stage is in stage_kernel.hpp.
//
// C. V. Rao, S. J. Wright, J. B. Rawlings, "Application of interior-point methods to model
// predictive control", J. Optim. Theory Appl. 99 (1998) 723–757. With the quadratic
// ½ zᵀ P z + gᵀ z of what is still to come, a stage's inputs and P follow from the next one's:
//
//   R = ρ + Bᵀ P B + …    H = Φᵀ P B + …    K = −H/R    P ← Φᵀ P Φ + … + H K + Kᵀ Hᵀ + Kᵀ R K
//
// "…" is the stage's own cost: nozzle at the node and in the middle of the interval, weighted rows.
// A base given at the end is kept by the last two inputs, whose K then is prescribed: with
// b = given and ḃ = 0 one interval later,
//
//   j_{N−1} = −2 (ḃ + b̈)     and so     b + 2/3 ḃ + 1/6 b̈ = given     at node N−1
//
// The interface is FlatForm's; costs are half the window's.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <memory>
#include <vector>

#include "axis_chain.hpp"
#include "lane_array.hpp"
#include "padded.hpp"
#include "shared_modes.hpp"
#include "stage_kernel.hpp"
#include "stretches.hpp"

namespace unflex::compensate {

class StageForm {
 public:
  void assign(const ScaledWindow& window);

  void evaluate(const PerKind<bool>& kinds);
  [[nodiscard]] double half_cost() const { return arrays_.half_cost; }
  [[nodiscard]] const double* rows(RowKind kind) const { return rows_[index_of(kind)].data(); }

  // Prepares for steps. Also for focus(), if there are no weights.
  [[nodiscard]] bool factor(const PerKind<const double*>& weights);
  // From now on rows have weights in these stretches alone. factor() works on the stretches and on
  // the nodes closely before them. Elsewhere the feedback without weights stays. Steps are then not
  // quite Newton's, but they lead to the same optimum, since gradients are exact. An empty list:
  // the whole window.
  void focus(const Stretches& stretches);
  void solve(const PerKind<const double*>& forces);
  [[nodiscard]] const double* row_steps(RowKind kind) const {
    return row_steps_[index_of(kind)].data();
  }
  [[nodiscard]] double decrement() const { return arrays_.decrement; }
  void advance(double length);
  // evaluate({}), solve({}) and advance(1) at once, where no rows and steps are asked for.
  void step_to_optimum();

  // For one set of aims after the other. Aims are in mm, of each model at the nodes and in the
  // middles behind them, model_places() numbers each.
  [[nodiscard]] std::size_t model_places() const { return kernel_->model_places(); }
  // Goes from the optimum for the previous aims to the optimum for these.
  void follow_aims(const LaneArray& node_aims_mm, const LaneArray& middle_aims_mm);
  // p of each model at the nodes, in mm, model_places() numbers each.
  void write_nozzles(LaneArray& nozzles_mm) const;

  void save();
  void restore();

  // States and inputs, the steps from node to node, and what is given at the ends.
  [[nodiscard]] ProblemSize size() const;

  void write(dynamics::AxisTrajectory& base) const;

 private:
  using Vector = Eigen::VectorXd;

  // The kinds with a row at every node. Each row is a component of z.
  static constexpr std::array<RowKind, 3> kNodeKinds = {RowKind::position, RowKind::velocity,
                                                        RowKind::accel};

  [[nodiscard]] std::size_t count() const { return model_.steps.front().count(); }
  // n: the components of z that are not left empty.
  [[nodiscard]] std::size_t components() const { return 2 * count() + 3; }
  // Where a component lies in a state of the kernel.
  [[nodiscard]] std::size_t place(std::size_t component) const;
  [[nodiscard]] std::size_t place(RowKind kind) const {
    return kernel_->base_place() + index_of(kind);
  }

  void set_model(const AxisWindow& window);
  void set_steps(const AxisWindow& window);
  void set_start();
  void set_aims();
  [[nodiscard]] bool factor_start();
  [[nodiscard]] std::size_t lead_nodes() const;
  // The step of the first node from the slope there.
  void set_first_step(const std::vector<double>& slope, double* step);
  void split_rows(const LaneArray& states, const Padded& inputs, const PerKind<bool>& kinds,
                  PerKind<Padded>& rows) const;

  const ScaledWindow* window_ = nullptr;
  StageModel model_;
  SharedModes shared_;
  std::unique_ptr<StageKernel> kernel_;
  StageArrays arrays_;
  std::vector<NodeRange> factored_;  // what factor() works on; empty: all
  int times_factored_ = 0;           // since focus()
  Eigen::MatrixXd start_basis_;      // δz_0 = start_basis_ y with y free
  Eigen::MatrixXd start_inverse_;
  std::vector<double> slope_;  // of the first node's cost
  std::vector<double> first_step_;
  double faint_pull_ = 0.0;
  LaneArray saved_states_;
  Padded saved_inputs_;
  PerKind<Padded> rows_;
  PerKind<Padded> row_steps_;
};

}  // namespace unflex::compensate
