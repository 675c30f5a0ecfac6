// An optimal-control problem on a given time span, independent of how it is discretised:
//
//   min ∫ L(t, x, u) dt + ∫ u̇ᵀ R u̇ dt    subject to    ẋ = f(t, x, u)
//
// with bounds on x(t), u(t) and the slope u̇(t). The control is piecewise linear between nodes.
//
//   x  states        u  controls        f  dynamics        L  running cost
//   R  diagonal      fx, fu, Lx, Lxx …  derivatives
#pragma once

#include <Eigen/Core>
#include <string>

namespace unflex::collocation {

inline constexpr int kMaxStates = 48;  // seven models of an axis with three modes each
inline constexpr int kMaxControls = 4;
inline constexpr int kMaxPoint = kMaxStates + kMaxControls;

using StateVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxStates, 1>;
using ControlVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxControls, 1>;
using PointVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxPoint, 1>;  // x above u
using StateByPoint =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxStates, kMaxPoint>;
using PointByPoint = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxPoint, kMaxPoint>;

// The entries of a derivative that can be non-zero at all.
using StateByPointPattern =
    Eigen::Matrix<bool, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxStates, kMaxPoint>;
using PointByPointPattern =
    Eigen::Matrix<bool, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxPoint, kMaxPoint>;

// All functions take the point z = (x, u) in one vector, states first.
class OptimalControlProblem {
 public:
  OptimalControlProblem() = default;
  OptimalControlProblem(const OptimalControlProblem&) = delete;
  OptimalControlProblem& operator=(const OptimalControlProblem&) = delete;
  virtual ~OptimalControlProblem() = default;

  [[nodiscard]] virtual int states() const = 0;
  [[nodiscard]] virtual int controls() const = 0;

  virtual void dynamics(double t, const PointVector& z, StateVector& f) const = 0;
  // ∂f/∂z, states × (states + controls).
  virtual void dynamics_jacobian(double t, const PointVector& z, StateByPoint& fz) const = 0;
  // Σ μ_i ∂²f_i/∂z², symmetric. Never called when linear_dynamics().
  virtual void dynamics_hessian(double t, const PointVector& z, const StateVector& mu,
                                PointByPoint& h) const = 0;
  [[nodiscard]] virtual StateByPointPattern dynamics_pattern() const = 0;
  [[nodiscard]] virtual bool linear_dynamics() const = 0;  // f linear in z, fz independent of t

  [[nodiscard]] virtual double cost(double t, const PointVector& z) const = 0;
  virtual void cost_gradient(double t, const PointVector& z, PointVector& gradient) const = 0;
  virtual void cost_hessian(double t, const PointVector& z, PointByPoint& h) const = 0;
  [[nodiscard]] virtual PointByPointPattern cost_pattern() const = 0;
  [[nodiscard]] virtual bool quadratic_cost() const = 0;

  // The weight of the squared slope, which is the diagonal of R, and the largest absolute slope
  // (kNoBound: free).
  [[nodiscard]] virtual ControlVector slope_weight() const = 0;
  [[nodiscard]] virtual ControlVector slope_limit() const = 0;

  // Bounds on z at node k of n (0 … n−1); equal bounds fix an unknown.
  virtual void node_bounds(int k, int n, PointVector& lower, PointVector& upper) const = 0;
  // A first guess of z at node k.
  virtual void guess(int k, double t, PointVector& z) const = 0;

  // "nozzle position", "base acceleration" …, in the order of z.
  [[nodiscard]] virtual std::string name(int component) const = 0;
};

}  // namespace unflex::collocation
