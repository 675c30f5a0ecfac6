// A quadratic program in a band, whose rows may be broken at a price.
//
//   min ½ δᵀHδ + qᵀδ + Σ ρ s    s.t.  l − s ≤ g·δ + v ≤ u + s,  s ≥ 0
//
//   δ   unknowns          g, v   gradient and value of a row, over W unknowns that stand together
//   l, u   bounds         ρ, s   price of a row, and by how much it is broken
//
// It always has a solution. Where ρ is above what a row's multiplier would be, the row holds.
//
// Method: a primal-dual interior point with Mehrotra's predictor and corrector (S. J. Wright,
// "Primal-Dual Interior-Point Methods", SIAM 1997, chapter 10). A side of a row has the room
// w = ±(bound − g·δ − v) + s, with multiplier λ, and s has the multiplier μ = ρ − λ:
//
//   λw = τ    μs = τ    Δλ = D (±g·Δδ + (τ − λw)/λ − (τ − μs)/μ),   D = 1/(w/λ + s/μ)
//
// which leaves a system in δ alone, with the matrix H + Σ D g gᵀ of half-bandwidth W − 1.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace unflex::quadratic {

template <int W>
class ElasticProgram {
 public:
  using Gradient = Eigen::Matrix<double, W, 1>;

  // Begins a program of this number of unknowns, without any term.
  void reset(std::size_t unknowns);
  // Adds ½ weight (g·δ + v)². first: the first of the unknowns.
  void add_square(std::size_t first, const Gradient& g, double v, double weight);
  // Adds ½ weight δ² of every unknown.
  void add_damping(double weight);
  void add_linear(std::size_t unknown, double slope) { linear_[unknown] += slope; }
  // The unknown stays 0.
  void fix(std::size_t unknown);
  // Adds a row. A bound may be infinite, but not both.
  void add_row(std::size_t first, const Gradient& g, double v, double lower, double upper,
               double price);

  // The value of a row, by its number, at the solution.
  [[nodiscard]] double value_at_solution(std::size_t row) const;
  [[nodiscard]] std::size_t rows() const { return values_.size(); }

  // δ with a cost of at most `gap` above the least one per unknown; nullopt if it is not found.
  // Adds the steps that it took to `iterations`.
  [[nodiscard]] std::optional<std::span<const double>> solve(double gap, int& iterations);

 private:
  // One bound of a row, seen so that it is an upper one.
  struct Side {
    std::size_t row = 0;
    double sign = 1.0;
    double room = 0.0;        // w
    double multiplier = 0.0;  // λ
    double breach = 0.0;      // s
    double slack = 0.0;       // μ
    double stiffness = 0.0;   // D
    // Changes of w, λ and s.
    double room_step = 0.0;
    double multiplier_step = 0.0;
    double breach_step = 0.0;
    // The products Δλ Δw and −Δλ Δs as the predictor foresees them.
    double room_product = 0.0;
    double breach_product = 0.0;
  };

  void start();
  // The sums over the sides of a row.
  struct RowWeight {
    double stiffness = 0.0;
    double multiplier = 0.0;
    double force = 0.0;
  };

  // Builds the matrix, the gradient of the Lagrangian, and the forces of the predictor. Returns the
  // gradient's largest entry.
  double linearise();
  // Sets the gradient of the Lagrangian to its part without rows.
  void start_lagrangian();
  // Sets the stiffness of the row's sides, which begin at `side`, and moves `side` behind them.
  RowWeight weigh(std::size_t row, std::size_t& side);
  // Adds this row and all after it whose unknowns begin at the same place. Their sum is added to
  // the matrix once. Returns the row behind them.
  std::size_t add_rows_at(std::size_t row, std::size_t& side);
  [[nodiscard]] bool factor();
  void back_substitute(std::vector<double>& x) const;
  // Finds the step towards τ = 0 and the forces of the corrector. Returns the share of the step
  // that can be taken.
  double predict();
  // Finds the step towards τ. Returns the share of the step that can be taken.
  double correct(double target);
  // Sets the steps of a side whose row moves by `along`, and shortens `length` to what they allow.
  static void move(double target, double along, Side& side, double& length);
  [[nodiscard]] double gap_after(double length) const;
  void advance(double length);
  void hold_fixed(std::vector<double>& x) const;

  std::size_t size_ = 0;
  // Column i holds rows i … i + W − 1.
  std::vector<double> hessian_;
  std::vector<double> linear_;
  std::vector<std::size_t> fixed_;
  std::vector<Gradient> gradients_;
  std::vector<std::size_t> first_;
  std::vector<double> values_;
  std::vector<double> prices_;
  std::vector<double> lower_;
  std::vector<double> upper_;
  std::vector<Side> sides_;
  std::vector<double> factor_;
  std::vector<double> delta_;
  std::vector<double> lagrangian_;
  std::vector<double> step_;
  // Forces of the corrector: the part without τ, and the factor of τ.
  std::vector<double> corrector_;
  std::vector<double> of_target_;
};

extern template class ElasticProgram<18>;
extern template class ElasticProgram<24>;

}  // namespace unflex::quadratic
