// The work of StageForm (stage_form.hpp) at each stage, for all nodes of a window. Modes and models
// lie in lanes (unflex/core/lanes.hpp). There is a kernel for each number of lanes that is common,
// whose loops the compiler unrolls, and one for any number.
//
// Notation, beside that of stage_form.hpp:
//   K     places of modes: their number, rounded up to full lanes. What is too many stays zero
//   swing (y_1 … y_K, ẏ_1 … ẏ_K), the part of z that lies in lanes
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "axis_chain.hpp"
#include "lane_array.hpp"
#include "padded.hpp"
#include "shared_modes.hpp"

namespace unflex::compensate {

// The step of the modes from node to node: A, a and β, each part for all modes.
struct ModeSteps {
  std::array<std::vector<double>, 4> own;  // A, by rows
  std::array<std::vector<double>, 2> by_accel;
  std::array<std::vector<double>, 2> by_jerk;

  void clear();
  // A mode whose gain counts as 1. omega_h: ωh.
  void add(double omega_h, double zeta);
  [[nodiscard]] std::size_t count() const { return own[0].size(); }
};

// Data that all stages of a window share.
struct StageModel {
  // The modes' steps, one for each set of frequencies that they have in the window.
  std::vector<ModeSteps> steps;
  std::vector<std::uint32_t> step_of;  // by intervals, into `steps`; empty: the first for all
  std::vector<SharedModes::Model> models;
  double jerk_weight = 0.0;  // ρ
};

// Coefficients of j in the next b, ḃ and b̈: b' = b + ḃ + b̈/2 + j/6 and so on.
inline constexpr std::array<double, 3> kBaseByJerk = {1.0 / 6.0, 0.5, 1.0};
// The coefficient of j in the next value of b + 2/3 ḃ + 1/6 b̈. If a base rests at the last node,
// this sum is given at the node before it (stage_form.hpp).
inline constexpr double kRestingByJerk = 1.0 / 6.0 + 0.5 * 2.0 / 3.0 + 1.0 / 6.0;

// The numbers of a window at its nodes and intervals.
struct StageArrays {
  std::size_t nodes = 0;
  bool rests_at_end = false;  // the last two inputs are prescribed
  LaneArray states;           // z, state_size() of each node
  LaneArray state_steps;
  Padded inputs;  // j
  Padded input_steps;
  LaneArray feedback;  // of each interval, as states
  Padded feedforward;
  Padded inverse_curvature;  // 0 where the feedback is prescribed
  Padded node_weight;
  Padded middle_weight;
  // For each model, at nodes and in the middles behind them: model_places() numbers each.
  LaneArray node_aim;
  LaneArray middle_aim;
  LaneArray node_pull;
  LaneArray middle_pull;
  double half_cost = 0.0;
  double decrement = 0.0;

  void resize(std::size_t node_count, std::size_t state_size, std::size_t model_places);
};

class StageKernel {
 public:
  static constexpr std::size_t kKeptNodes = 32;

  StageKernel() = default;
  StageKernel(const StageKernel&) = delete;
  StageKernel& operator=(const StageKernel&) = delete;
  virtual ~StageKernel() = default;

  [[nodiscard]] virtual std::size_t mode_places() const = 0;   // K
  [[nodiscard]] virtual std::size_t model_places() const = 0;  // models, in full lanes
  // The size of a state: y, ẏ, b, ḃ, b̈ and an empty place. It follows from K, as base_place()
  // does. Each kernel still defines both, so that the compiler knows their values in the innermost
  // loops.
  [[nodiscard]] virtual std::size_t state_size() const = 0;
  [[nodiscard]] virtual std::size_t base_place() const = 0;

  virtual void assign(const StageModel& model) = 0;
  // Computes z from node to node. Inputs are zero, except those that the end prescribes. resting:
  // where the base comes to rest, if it does.
  virtual void roll_out(double resting, StageArrays& at) const = 0;
  // Computes the feedback of all intervals, from the last stage to the first. P of the first node
  // is in cost_to_go(). False if the program has no minimum.
  [[nodiscard]] virtual bool factor(const PerKind<const double*>& weights, StageArrays& at) = 0;
  // Does the work of factor(), and keeps P of every kKeptNodes-th node.
  [[nodiscard]] virtual bool factor_and_keep(const PerKind<const double*>& weights,
                                             StageArrays& at) = 0;
  // Computes the feedback of the intervals between these nodes alone. `last` is a node whose P is
  // kept, or the window's last node. Sets cost_to_go() if `first` is the window's first node.
  [[nodiscard]] virtual bool factor_between(std::size_t first, std::size_t last,
                                            const PerKind<const double*>& weights,
                                            StageArrays& at) = 0;
  // P between two places of z of the first node.
  [[nodiscard]] virtual double cost_to_go(std::size_t row, std::size_t column) const = 0;
  // Pulls and cost of the present states.
  virtual void evaluate(StageArrays& at) const = 0;
  // Takes other aims, in StageArrays' order, as (aim − origin) per unit. Pulls become the changes
  // of the aims, since at the optimum for the old aims nothing else pulls.
  virtual void change_aims(const double* node_aims, const double* middle_aims, double origin,
                           double per_unit, StageArrays& at) const = 0;
  // Computes the inputs' feedforward, from the last stage to the first. slope: that of the first
  // node's cost, state_size() numbers. faint_pull: kFaintPull. pulled_by_inputs: whether ρ j
  // counts; the change of an optimum has no such part.
  virtual void carry_slope_back(const PerKind<const double*>& forces, double faint_pull,
                                bool pulled_by_inputs, StageArrays& at, double* slope) const = 0;
  // Computes the steps of all states from the step of the first node.
  virtual void step_forward(StageArrays& at) const = 0;
  // Takes the steps of step_forward() at once, without storing them.
  virtual void go_forward(const double* first_step, StageArrays& at) const = 0;
  // p of each model at the nodes: origin + unit times the scaled one, in StageArrays' order.
  virtual void write_nozzles(double origin, double unit, const StageArrays& at,
                             double* nozzles) const = 0;
};

// The kernel for these numbers of modes and models, by the processor's registers.
[[nodiscard]] std::unique_ptr<StageKernel> make_stage_kernel(std::size_t modes, std::size_t models);

}  // namespace unflex::compensate
