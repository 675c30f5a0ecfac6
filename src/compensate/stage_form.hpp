// The window stage by stage: states z_k and inputs j_k, stepped by a Riccati recursion. It is
// several times the work of the flat form (flat_form.hpp), but takes any window: of two nodes, of
// any ωh, axes of several modes, and any number of models of the axis (AxisWindow::plants).
//
// Notation, beside that of axis_chain.hpp:
//   q_i, g_i    a mode's part of the nozzle's motion and its gain, of any model
//   y_i         q_i − g_i b
//   z           (y_1, …, y_K, ẏ_1, …, ẏ_K, b, ḃ, b̈)
//   c           models; p_c = b + Σ y_i over the modes of c
//
// A base that moves evenly takes all modes along, so y depends on its acceleration alone:
//
//   (y_i, ẏ_i)' = A_i (y_i, ẏ_i) + a_i b̈ + β_i j      b' = b + ḃ + b̈/2 + j/6      …
//
// Φ is then four diagonals and one column, a, and Φᵀ P Φ costs 8 K² + n² multiplications for n = 2K
// + 3 states instead of 2 n³. As P is symmetric, only its upper triangle is computed. All loops run
// along rows, so that the compiler takes several columns at once.
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
#include <vector>

#include "axis_chain.hpp"
#include "padded.hpp"

namespace unflex::compensate {

// How the modes go from node to node: A, a and β above, each part for all modes.
struct ModeSteps {
  std::array<std::vector<double>, 4> own;  // A, by rows
  std::array<std::vector<double>, 2> by_accel;
  std::array<std::vector<double>, 2> by_jerk;

  void clear();
  // period_s: h.
  void add(const dynamics::Mode& mode, double period_s);
  [[nodiscard]] std::size_t count() const { return own[0].size(); }
};

class StageForm {
 public:
  void assign(const ScaledWindow& window);
  // The window's aims are read where they are.
  void set_aims() {}

  void evaluate(const PerKind<bool>& kinds);
  [[nodiscard]] double half_cost() const { return half_cost_; }
  [[nodiscard]] const double* rows(RowKind kind) const { return rows_[index_of(kind)].data(); }

  [[nodiscard]] bool factor(const PerKind<const double*>& weights);
  void solve(const PerKind<const double*>& forces);
  [[nodiscard]] const double* row_steps(RowKind kind) const {
    return row_steps_[index_of(kind)].data();
  }
  [[nodiscard]] double decrement() const { return decrement_; }
  void advance(double length);

  void save();
  void restore();

  // States and inputs, the steps from node to node, and what is given at the ends.
  [[nodiscard]] ProblemSize size() const;

  void write(dynamics::AxisTrajectory& base) const;
  // p of each model at the nodes.
  void write_nozzles(std::vector<std::vector<double>>& nozzles_mm) const;

 private:
  using Vector = Eigen::VectorXd;
  using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  // The kinds with a row at every node. Each row is a component of z.
  static constexpr std::array<RowKind, 3> kNodeKinds = {RowKind::position, RowKind::velocity,
                                                        RowKind::accel};

  // A model of the axis: what its nozzle is made of.
  struct Model {
    std::size_t first_mode = 0;
    std::size_t end_mode = 0;
    double share = 0.0;         // α
    Vector middle;              // coefficients of z_k in p_c in the middle of the interval
    double middle_input = 0.0;  // coefficient of j_k there
  };

  [[nodiscard]] std::size_t rates() const { return modes_.count(); }     // place of ẏ_1 in z
  [[nodiscard]] std::size_t base() const { return 2 * modes_.count(); }  // place of b in z
  [[nodiscard]] std::size_t place(RowKind kind) const { return base() + index_of(kind); }
  [[nodiscard]] double* state(std::vector<double>& of, std::size_t k) const {
    return of.data() + k * size_;
  }
  [[nodiscard]] const double* state(const std::vector<double>& of, std::size_t k) const {
    return of.data() + k * size_;
  }

  void set_models(const AxisWindow& window);
  void set_start();
  void roll_out(const Vector& first);
  // z_{k+1} from z_k and j_k.
  void step(const double* z, double input, double* next) const;
  // v ← Φᵀ v
  void transpose_step(double* v) const;
  [[nodiscard]] double by_input(const double* v) const;                    // Bᵀ v
  [[nodiscard]] double by_feedback(std::size_t k, const double* z) const;  // K z
  void add_node(std::size_t k, const PerKind<const double*>& forces, double* g) const;
  void carry_slope_back(std::size_t k, const PerKind<const double*>& forces, double* g);
  // p_c − b, or its rate, or its step.
  [[nodiscard]] double swing(const Model& model, const double* z, std::size_t rate = 0) const;
  void split_rows(const std::vector<double>& states, const Padded& inputs,
                  const PerKind<bool>& kinds, PerKind<Padded>& rows) const;
  // The upper triangle of Φᵀ P Φ into next_, from cost_to_go_.
  void carry_back();
  [[nodiscard]] bool prescribed(std::size_t k) const;
  void set_prescribed_feedback(std::size_t k, double* feedback) const;
  [[nodiscard]] bool factor_start();

  const ScaledWindow* window_ = nullptr;
  std::size_t nodes_ = 0;
  std::size_t size_ = 0;  // n
  ModeSteps modes_;
  std::vector<double> gains_;
  std::vector<Model> models_;
  std::vector<std::size_t> model_of_;  // of each mode
  // Coefficients of each mode's y and ẏ in p_c of its own model in the middle of the interval.
  std::vector<double> middle_of_;
  Matrix node_square_;    // Σ α of the squares of p_c
  Matrix middle_square_;  // likewise in the middle
  Vector middle_cross_;   // Σ α μ_c m_c
  double middle_curvature_ = 0.0;
  Matrix start_basis_;  // δz_0 = start_basis_ y with y free
  Eigen::MatrixXd start_inverse_;

  std::vector<double> states_;  // n for each node
  std::vector<double> saved_states_;
  std::vector<double> state_steps_;
  Padded inputs_;
  Padded saved_inputs_;
  Padded input_steps_;
  Padded feedforward_;
  std::vector<double> feedback_;  // n for each interval
  Padded inverse_curvature_;      // 0 where the feedback is prescribed
  Padded node_weight_;
  Padded middle_weight_;
  std::vector<double> node_pull_;  // of each model at each node
  std::vector<double> middle_pull_;
  Matrix cost_to_go_;  // P
  Matrix next_;
  Vector by_accel_;   // P a, the last column of P Φ
  Vector pivot_row_;  // what a stage's input takes off P, as the square of this row
  std::array<std::vector<double>, 4> in_rows_;  // a row of P Φ for a mode's place and rate
  Vector accel_column_;                         // the last column of Φ
  Vector input_column_;                         // B
  Vector by_input_;
  Vector cross_;
  double half_cost_ = 0.0;
  double decrement_ = 0.0;
  double faint_pull_ = 0.0;
  PerKind<Padded> rows_;
  PerKind<Padded> row_steps_;
};

}  // namespace unflex::compensate
