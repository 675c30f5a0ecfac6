// A nonlinear program, independent of any solver:
//
//   min f(x)   subject to   g_L ≤ g(x) ≤ g_U,   x_L ≤ x ≤ x_U
//
//   x   n unknowns          f   objective          g   m constraints
//   ∇f  gradient            J   Jacobian of g      H   Hessian of  σ f + λᵀ g, lower triangle
#pragma once

#include <span>
#include <string>
#include <vector>

namespace unflex::nlp {

// Where a sparse matrix may be non-zero. Entry i stands at (row[i], column[i]), 0-based; no place
// occurs twice.
struct Sparsity {
  std::vector<int> row;
  std::vector<int> column;
};

// Absolute values at and above this mean "no bound".
inline constexpr double kNoBound = 1e19;

struct Bounds {
  std::vector<double> lower;
  std::vector<double> upper;
};

class Problem {
 public:
  Problem() = default;
  Problem(const Problem&) = delete;
  Problem& operator=(const Problem&) = delete;
  virtual ~Problem() = default;

  [[nodiscard]] virtual const Bounds& variable_bounds() const = 0;    // sizes give n
  [[nodiscard]] virtual const Bounds& constraint_bounds() const = 0;  // sizes give m
  [[nodiscard]] virtual const std::vector<double>& start() const = 0;
  // Whether g is linear, and whether f is quadratic. If g is linear, J is evaluated only once; if
  // both hold, H too.
  [[nodiscard]] virtual bool linear_constraints() const = 0;
  [[nodiscard]] virtual bool quadratic_objective() const = 0;

  [[nodiscard]] virtual double objective(std::span<const double> x) const = 0;
  virtual void gradient(std::span<const double> x, std::span<double> gradient) const = 0;
  virtual void constraints(std::span<const double> x, std::span<double> g) const = 0;

  [[nodiscard]] virtual const Sparsity& jacobian_sparsity() const = 0;
  virtual void jacobian(std::span<const double> x, std::span<double> values) const = 0;
  [[nodiscard]] virtual const Sparsity& hessian_sparsity() const = 0;
  virtual void hessian(std::span<const double> x, double sigma, std::span<const double> lambda,
                       std::span<double> values) const = 0;

  // Names for messages, e.g. "base velocity, node 17".
  [[nodiscard]] virtual std::string variable_name(int index) const = 0;
  [[nodiscard]] virtual std::string constraint_name(int index) const = 0;
};

}  // namespace unflex::nlp
