// Optimal-control problems for the tests.
#pragma once

#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "unflex/collocation/optimal_control_problem.hpp"
#include "unflex/nlp/problem.hpp"

namespace unflex::collocation::testing {

// Linear or affine dynamics ẋ = A x + B u + c(t) and cost (z − target(t))ᵀ Q (z − target(t)), with
// some states fixed at the beginning and at the end.
class LinearQuadratic : public OptimalControlProblem {
 public:
  Eigen::MatrixXd a;                              // states × states
  Eigen::MatrixXd b;                              // states × controls
  Eigen::MatrixXd q;                              // symmetric, points × points
  std::function<Eigen::VectorXd(double)> drift;   // c(t); unset: zero
  std::function<Eigen::VectorXd(double)> target;  // unset: zero
  std::vector<std::pair<int, double>> first;      // component, value
  std::vector<std::pair<int, double>> last;
  double weight_of_slope = 0.0;
  double limit_of_slope = nlp::kNoBound;

  int states() const override { return static_cast<int>(a.rows()); }
  int controls() const override { return static_cast<int>(b.cols()); }
  void dynamics(double t, const PointVector& z, StateVector& f) const override {
    f = a * z.head(states()) + b * z.tail(controls());
    if (drift) {
      f += drift(t);
    }
  }
  void dynamics_jacobian(double /*t*/, const PointVector& /*z*/, StateByPoint& fz) const override {
    fz.leftCols(states()) = a;
    fz.rightCols(controls()) = b;
  }
  void dynamics_hessian(double /*t*/, const PointVector& /*z*/, const StateVector& /*mu*/,
                        PointByPoint& h) const override {
    h.setConstant(std::nan(""));  // nobody may ask for it
  }
  StateByPointPattern dynamics_pattern() const override {
    StateByPoint fz(states(), points());
    dynamics_jacobian(0.0, {}, fz);
    return (fz.array() != 0.0).matrix();
  }
  bool linear_dynamics() const override { return true; }
  double cost(double t, const PointVector& z) const override {
    const Eigen::VectorXd e = off(t, z);
    return e.dot(q * e);
  }
  void cost_gradient(double t, const PointVector& z, PointVector& gradient) const override {
    gradient = 2.0 * q * off(t, z);
  }
  void cost_hessian(double /*t*/, const PointVector& /*z*/, PointByPoint& h) const override {
    h = 2.0 * q;
  }
  PointByPointPattern cost_pattern() const override { return (q.array() != 0.0).matrix(); }
  bool quadratic_cost() const override { return true; }
  ControlVector slope_weight() const override {
    return ControlVector::Constant(controls(), weight_of_slope);
  }
  ControlVector slope_limit() const override {
    return ControlVector::Constant(controls(), limit_of_slope);
  }
  void node_bounds(int k, int n, PointVector& lower, PointVector& upper) const override {
    lower.setConstant(-nlp::kNoBound);
    upper.setConstant(nlp::kNoBound);
    const auto fix = [&](const std::vector<std::pair<int, double>>& values) {
      for (const auto& [component, value] : values) {
        lower(component) = upper(component) = value;
      }
    };
    if (k == 0) {
      fix(first);
    }
    if (k == n - 1) {
      fix(last);
    }
  }
  void guess(int /*k*/, double /*t*/, PointVector& z) const override { z.setZero(); }
  std::string name(int component) const override {
    return (component < states() ? "state " : "control ") + std::to_string(component);
  }

 private:
  int points() const { return states() + controls(); }
  Eigen::VectorXd off(double t, const PointVector& z) const {
    return target ? Eigen::VectorXd(z - target(t)) : Eigen::VectorXd(z);
  }
};

// A problem with all that a derivative could get wrong: nonlinear, coupled, explicit in time, two
// controls, a cost that is not quadratic, one slope limited and weighted, and structural zeros.
//
//   θ̇ = v
//   v̇ = −(1 + 0.3 sin t) sin θ − 0.2 v³ + u cos θ
//   q̇ = w v + e^{−t/10} θ q
//   L = (1 + ½ cos 2t) θ⁴ + u² (1 + θ²) + e^{0.3 w} + v sin q
class DrivenPendulum : public OptimalControlProblem {
 public:
  enum Component : int { kTheta = 0, kV, kQ, kU, kW };

  int states() const override { return 3; }
  int controls() const override { return 2; }
  void dynamics(double t, const PointVector& z, StateVector& f) const override {
    f(0) = z(kV);
    f(1) =
        -gravity(t) * std::sin(z(kTheta)) - 0.2 * std::pow(z(kV), 3) + z(kU) * std::cos(z(kTheta));
    f(2) = z(kW) * z(kV) + fade(t) * z(kTheta) * z(kQ);
  }
  void dynamics_jacobian(double t, const PointVector& z, StateByPoint& fz) const override {
    fz.setZero();
    fz(0, kV) = 1.0;
    fz(1, kTheta) = -gravity(t) * std::cos(z(kTheta)) - z(kU) * std::sin(z(kTheta));
    fz(1, kV) = -0.6 * z(kV) * z(kV);
    fz(1, kU) = std::cos(z(kTheta));
    fz(2, kTheta) = fade(t) * z(kQ);
    fz(2, kV) = z(kW);
    fz(2, kQ) = fade(t) * z(kTheta);
    fz(2, kW) = z(kV);
  }
  void dynamics_hessian(double t, const PointVector& z, const StateVector& mu,
                        PointByPoint& h) const override {
    h.setZero();
    h(kTheta, kTheta) = mu(1) * (gravity(t) * std::sin(z(kTheta)) - z(kU) * std::cos(z(kTheta)));
    h(kV, kV) = -1.2 * mu(1) * z(kV);
    h(kTheta, kU) = h(kU, kTheta) = -mu(1) * std::sin(z(kTheta));
    h(kTheta, kQ) = h(kQ, kTheta) = mu(2) * fade(t);
    h(kV, kW) = h(kW, kV) = mu(2);
  }
  StateByPointPattern dynamics_pattern() const override {
    StateByPointPattern pattern(3, 5);
    pattern << false, true, false, false, false,  //
        true, true, false, true, false,           //
        true, true, true, false, true;
    return pattern;
  }
  bool linear_dynamics() const override { return false; }
  double cost(double t, const PointVector& z) const override {
    const double theta2 = z(kTheta) * z(kTheta);
    return swell(t) * theta2 * theta2 + z(kU) * z(kU) * (1.0 + theta2) + std::exp(0.3 * z(kW)) +
           z(kV) * std::sin(z(kQ));
  }
  void cost_gradient(double t, const PointVector& z, PointVector& gradient) const override {
    const double theta = z(kTheta);
    gradient(kTheta) = 4.0 * swell(t) * std::pow(theta, 3) + 2.0 * z(kU) * z(kU) * theta;
    gradient(kV) = std::sin(z(kQ));
    gradient(kQ) = z(kV) * std::cos(z(kQ));
    gradient(kU) = 2.0 * z(kU) * (1.0 + theta * theta);
    gradient(kW) = 0.3 * std::exp(0.3 * z(kW));
  }
  void cost_hessian(double t, const PointVector& z, PointByPoint& h) const override {
    const double theta = z(kTheta);
    h.setZero();
    h(kTheta, kTheta) = 12.0 * swell(t) * theta * theta + 2.0 * z(kU) * z(kU);
    h(kTheta, kU) = h(kU, kTheta) = 4.0 * z(kU) * theta;
    h(kU, kU) = 2.0 * (1.0 + theta * theta);
    h(kV, kQ) = h(kQ, kV) = std::cos(z(kQ));
    h(kQ, kQ) = -z(kV) * std::sin(z(kQ));
    h(kW, kW) = 0.09 * std::exp(0.3 * z(kW));
  }
  PointByPointPattern cost_pattern() const override {
    PointByPoint h(5, 5);
    PointVector z(5);
    z.setOnes();
    cost_hessian(0.3, z, h);
    return (h.array() != 0.0).matrix();
  }
  bool quadratic_cost() const override { return false; }
  ControlVector slope_weight() const override { return (ControlVector(2) << 0.3, 0.0).finished(); }
  ControlVector slope_limit() const override {
    return (ControlVector(2) << nlp::kNoBound, 2.5).finished();
  }
  void node_bounds(int k, int /*n*/, PointVector& lower, PointVector& upper) const override {
    lower.setConstant(-nlp::kNoBound);
    upper.setConstant(nlp::kNoBound);
    if (k == 0) {
      lower.head(3) = upper.head(3) = Eigen::Vector3d(0.5, 0.0, -0.2);
    }
  }
  void guess(int k, double t, PointVector& z) const override {
    z << t, 10.0 * k, -t, 0.25, 0.5 * k;
  }
  std::string name(int component) const override {
    static constexpr const char* kNames[] = {"angle", "rate", "charge", "torque", "current"};
    return kNames[component];
  }

 private:
  static double gravity(double t) { return 1.0 + 0.3 * std::sin(t); }
  static double fade(double t) { return std::exp(-0.1 * t); }
  static double swell(double t) { return 1.0 + 0.5 * std::cos(2.0 * t); }
};

// The driven pendulum with linear dynamics, declared as linear. Its cost is not quadratic, so the
// Hessian has the pattern's entries instead of being full.
class LinearPendulum final : public DrivenPendulum {
 public:
  void dynamics(double t, const PointVector& z, StateVector& f) const override {
    f(0) = z(kV);
    f(1) = -2.0 * z(kTheta) - 0.2 * z(kV) + z(kU) + std::sin(t);
    f(2) = z(kW) - 0.5 * z(kQ);
  }
  void dynamics_jacobian(double /*t*/, const PointVector& /*z*/, StateByPoint& fz) const override {
    fz << 0.0, 1.0, 0.0, 0.0, 0.0,  //
        -2.0, -0.2, 0.0, 1.0, 0.0,  //
        0.0, 0.0, -0.5, 0.0, 1.0;
  }
  StateByPointPattern dynamics_pattern() const override {
    StateByPoint fz(3, 5);
    dynamics_jacobian(0.0, {}, fz);
    return (fz.array() != 0.0).matrix();
  }
  bool linear_dynamics() const override { return true; }
};

}  // namespace unflex::collocation::testing
