// The window stage by stage: states z_k and inputs j_k of axis_chain.hpp, stepped by a Riccati
// recursion. It is several times the work of the flat form (flat_form.hpp), but takes any window.
// The recursion never expresses the nozzle by differences of the base's motion, so a small ωh costs
// no digits, and two nodes are enough. It also takes several models of the axis
// (AxisWindow::variants), each of one mode; then
//
//   z_k = (p_1, ṗ_1, …, p_m, ṗ_m, b, ḃ, b̈)
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
#include <cstddef>
#include <vector>

#include "axis_chain.hpp"
#include "padded.hpp"

namespace unflex::compensate {

// kModels: m.
template <int kModels>
class StageForm {
 public:
  static constexpr int kStates = 2 * kModels + 3;
  using State = Eigen::Matrix<double, kStates, 1>;
  using Square = Eigen::Matrix<double, kStates, kStates>;

  void assign(const ScaledWindow& window);

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

  void write(dynamics::AxisTrajectory& base) const;

 private:
  struct Stage {
    State feedback;            // Kᵀ
    double inverse_curvature;  // 1/R; 0 where K is prescribed
  };

  // Whether the input of interval k is prescribed, so as to keep the end.
  [[nodiscard]] bool prescribed(std::size_t k) const;
  [[nodiscard]] State prescribed_feedback(std::size_t k) const;
  [[nodiscard]] bool factor_start(const Square& to_come);
  void first_guess();
  void roll_out(const State& first);
  void split_rows(const std::vector<State>& states, const Padded& inputs,
                  const PerKind<bool>& kinds, PerKind<Padded>& rows) const;

  const ScaledWindow* window_ = nullptr;
  std::size_t nodes_ = 0;
  // Places in z.
  static constexpr Eigen::Index kBase = 2 * kModels;
  static constexpr Eigen::Index kBaseRate = kBase + 1;
  static constexpr Eigen::Index kBaseAccel = kBase + 2;
  static constexpr Eigen::Index nozzle(std::size_t model) {
    return 2 * static_cast<Eigen::Index>(model);
  }
  static constexpr Eigen::Index component_of(RowKind kind) {
    return kBase + static_cast<Eigen::Index>(kind);
  }
  [[nodiscard]] static State resting_soon();

  using Middles = Eigen::Matrix<double, kStates, kModels>;
  using PerModel = Eigen::Matrix<double, kModels, 1>;
  // p_c − r in the interval after node k, and p − r at node k.
  [[nodiscard]] PerModel middle_errors(std::size_t k) const;
  [[nodiscard]] PerModel errors(std::size_t k) const;

  Square transition_;      // Φ
  State input_;            // B
  Middles middle_;         // coefficients of z_k in p_c
  PerModel middle_input_;  // coefficient of j_k in p_c
  PerModel share_;         // α
  // δz_0 = start_basis_ y with y free, found by start_inverse_.
  Eigen::Matrix<double, kStates, Eigen::Dynamic, 0, kStates, kStates> start_basis_;
  using Reduced = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kStates, kStates>;
  Reduced start_inverse_;

  std::vector<State> states_;
  std::vector<State> saved_states_;
  std::vector<State> state_steps_;
  Padded inputs_;
  Padded saved_inputs_;
  Padded input_steps_;
  Padded feedforward_;
  std::vector<Stage> stages_;
  Padded node_weight_;
  Padded middle_weight_;
  std::vector<PerModel> node_pull_;
  std::vector<PerModel> middle_pull_;
  double half_cost_ = 0.0;
  double decrement_ = 0.0;
  double faint_pull_ = 0.0;
  PerKind<Padded> rows_;
  PerKind<Padded> row_steps_;
};

extern template class StageForm<1>;
extern template class StageForm<3>;
extern template class StageForm<5>;

}  // namespace unflex::compensate
