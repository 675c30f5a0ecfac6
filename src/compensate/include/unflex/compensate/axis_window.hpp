// The optimal-control problem of one axis over one window, as plain data, and the interface behind
// which its solvers stand.
//
//   min Σ_i α_i ∫ w(t) (p_i − a_i)² dt + ρ ∫ (d b̈/dt)² dt
//   s.t.  p_i hangs on b as dynamics/flexible_axis.hpp says,   b̈ piecewise linear,
//         |ḃ| ≤ V,  |b̈| ≤ A,  |d b̈/dt| ≤ J,  b_min ≤ b ≤ b_max
//
//   r  reference, mm       p  nozzle, mm       b  base, mm       w  weight       h  node period, s
//   i  models of the axis: one if it is known, several on the same base if it is not; their shares
//      α_i add up to 1
//   a  where the nozzle of model i shall be, mm: r, or another place near it for each
//
// Nozzle and base are both unknown: with the nozzle fixed to the plan the problem is
// overdetermined (docs/theory.md).
#pragma once

#include <cstddef>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "unflex/core/error.hpp"
#include "unflex/core/problem_size.hpp"
#include "unflex/dynamics/base_trajectory.hpp"
#include "unflex/dynamics/flexible_axis.hpp"

namespace unflex::compensate {

// These limits hold between nodes too: those of position and velocity if acceleration is limited,
// and position within 10⁻⁵ mm.
struct BaseLimits {
  double max_velocity_mm_s = std::numeric_limits<double>::infinity();  // V
  double max_accel_mm_s2 = std::numeric_limits<double>::infinity();    // A
  double max_jerk_mm_s3 = std::numeric_limits<double>::infinity();     // J
  double min_position_mm = -std::numeric_limits<double>::infinity();
  double max_position_mm = std::numeric_limits<double>::infinity();
};

// Another model that the axis may have.
struct Plant {
  dynamics::FlexibleAxis axis;
  double share = 0.0;  // α
  // An edge of a band of frequencies around a model, and not a model of its own.
  bool is_edge = false;
};

struct AxisWindow {
  dynamics::FlexibleAxis axis;
  std::vector<Plant> plants;  // `axis` has the share that they leave
  double period_s = 1e-3;     // h
  // r and w at the nodes and in the middles between them: 2n − 1 values for n nodes, n ≥ 2.
  std::vector<double> reference_mm;
  std::vector<double> weight;
  // The frequencies of all models relative to those given, at the places of r. Empty: 1. Damping
  // ratios stay.
  std::vector<double> freq_shares;
  // a of each model, at the places of r. Empty: r for all.
  std::vector<std::vector<double>> aims_mm;
  // ρ/h⁶: without dimension, so that one value serves all periods.
  double jerk_weight = 1e-2;
  BaseLimits limits;
  // V and A at the nodes, where another axis on the same motors leaves less than `limits`. Empty:
  // `limits` alone holds.
  std::vector<double> max_velocity_at_mm_s;
  std::vector<double> max_accel_at_mm_s2;
  // The state at the first node: the nozzle as given, in all models, and the base at rest at
  // base_mm. Unset: free.
  struct Start {
    dynamics::NozzleState nozzle;
    double base_mm = 0.0;
  };
  std::optional<Start> start;
  // Where the base rests at the last node. Unset: free.
  std::optional<double> end_base_mm;
  // A motion near the solution, at the nodes, from which an iterating engine may begin. It does not
  // change the solution, and is not passed on to worker processes.
  struct Guess {
    std::vector<dynamics::NozzleState> nozzle;
    dynamics::AxisTrajectory base;
  };
  std::optional<Guess> guess;

  [[nodiscard]] std::size_t nodes() const { return (reference_mm.size() + 1) / 2; }
  // Model i: `axis` is model 0, plants[i − 1] is model i.
  [[nodiscard]] std::size_t models() const { return plants.size() + 1; }
  [[nodiscard]] Plant model(std::size_t i) const;
  [[nodiscard]] const std::vector<double>& aim_mm(std::size_t i) const {
    return aims_mm.empty() ? reference_mm : aims_mm[i];
  }
  // Returns the state of model i with the swing that `nozzle` has. `nozzle` is a state of `axis`
  // while the base is at base_mm.
  [[nodiscard]] dynamics::NozzleState in_model(std::size_t i, const dynamics::NozzleState& nozzle,
                                               double base_mm) const;
};

struct AxisSolution {
  dynamics::AxisTrajectory base;
  double objective = 0.0;  // mm²·s
  int iterations = 0;
  // How large the problem is as the engine puts it. Worker processes do not pass it on.
  ProblemSize size = {};
};

// A solver of axis windows.
class Engine {
 public:
  Engine() = default;
  Engine(const Engine&) = delete;
  Engine& operator=(const Engine&) = delete;
  virtual ~Engine() = default;

  // Returns an error if the window has no solution or the solver does not find it.
  [[nodiscard]] virtual Result<AxisSolution> solve(const AxisWindow& window) const = 0;
  [[nodiscard]] virtual std::string name() const = 0;
};

// Whether the library was built with Ipopt.
[[nodiscard]] bool has_ipopt_engine();

// Hargraves–Paris transcription solved by Ipopt. Not thread-safe (see nlp/ipopt_solver.hpp). Null
// if the library was built without Ipopt.
[[nodiscard]] std::unique_ptr<Engine> make_ipopt_engine();

// Solves the program of make_ipopt_engine() without its equality constraints, by interior points of
// unflex's own. Any number of threads may solve at once, with one engine or several.
[[nodiscard]] std::unique_ptr<Engine> make_banded_engine();

// A make_banded_engine() that stops earlier, for callers that solve many windows as intermediate
// steps. Limits may be exceeded by a ten-thousandth, and the cost may be above the optimum by a
// ten-thousandth.
[[nodiscard]] std::unique_ptr<Engine> make_rough_engine();

}  // namespace unflex::compensate
