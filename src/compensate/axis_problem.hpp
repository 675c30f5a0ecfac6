// The axis window as an OptimalControlProblem, in units that bring the unknowns to about 1: time in
// node periods, lengths in hundredths of a millimetre from the window's first reference point.
#pragma once

#include <cstddef>
#include <vector>

#include "limits.hpp"
#include "shared_modes.hpp"
#include "unflex/collocation/optimal_control_problem.hpp"
#include "unflex/compensate/axis_window.hpp"

namespace unflex::compensate {

inline constexpr double kLengthUnitMm = 0.01;

// States q, q̇, b, ḃ, then q_i, q̇_i of the other modes of all models of the axis (shared_modes.hpp);
// control b̈. A model's nozzle is the sum of its modes' q times their gains; with one mode q is p.
class AxisProblem final : public collocation::OptimalControlProblem {
 public:
  // The numbers are places in z if the axis has one model of one mode.
  enum Component : int { kNozzle = 0, kNozzleRate, kBase, kBaseRate, kBaseAccel };

  // The window must outlive the problem.
  AxisProblem(const AxisWindow& window, ActiveLimits active);

  // The place of a component in z. A component of the nozzle has one place for each mode; modes are
  // counted as in SharedModes.
  [[nodiscard]] int place(Component component, std::size_t mode = 0) const;

  int states() const override { return 2 + 2 * static_cast<int>(modes_.size()); }
  int controls() const override { return 1; }

  void dynamics(double t, const collocation::PointVector& z,
                collocation::StateVector& f) const override;
  void dynamics_jacobian(double t, const collocation::PointVector& z,
                         collocation::StateByPoint& fz) const override;
  void dynamics_hessian(double t, const collocation::PointVector& z,
                        const collocation::StateVector& mu,
                        collocation::PointByPoint& h) const override;
  collocation::StateByPointPattern dynamics_pattern() const override;
  bool linear_dynamics() const override { return true; }

  double cost(double t, const collocation::PointVector& z) const override;
  void cost_gradient(double t, const collocation::PointVector& z,
                     collocation::PointVector& gradient) const override;
  void cost_hessian(double t, const collocation::PointVector& z,
                    collocation::PointByPoint& h) const override;
  collocation::PointByPointPattern cost_pattern() const override;
  bool quadratic_cost() const override { return true; }

  collocation::ControlVector slope_weight() const override;
  collocation::ControlVector slope_limit() const override;
  void node_bounds(int k, int n, collocation::PointVector& lower,
                   collocation::PointVector& upper) const override;
  void guess(int k, double t, collocation::PointVector& z) const override;
  std::string name(int component) const override;

  // Convert a component between scaled and physical values, mm and s.
  [[nodiscard]] double to_physical(Component component, double scaled) const;
  [[nodiscard]] double to_scaled(Component component, double physical) const;

 private:
  // The place in r and w that belongs to time t, which is a node or a middle.
  [[nodiscard]] std::size_t sample(double t) const;

  const AxisWindow* window_;
  ActiveLimits active_;
  double origin_mm_;
  struct Mode {
    double damping;    // 2ζωh
    double stiffness;  // (ωh)²
  };
  // Mode i at time t, which is a node or a middle.
  [[nodiscard]] Mode mode_at(std::size_t i, double t) const;

  std::vector<Mode> modes_;  // of all models
  std::vector<SharedModes::Model> models_;
  // Sets the places of the nozzle in z, of all models.
  void set_nozzle(const dynamics::NozzleState& nozzle, double base_mm,
                  collocation::PointVector& z) const;
  // p − r of a model.
  [[nodiscard]] double error(std::size_t model, std::size_t sampled,
                             const collocation::PointVector& z) const;
};

}  // namespace unflex::compensate
