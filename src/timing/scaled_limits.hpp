// The limits that the scaled timing gives to the pieces of a run's path and to their vertices. They
// are raised and lowered from round to round (local_scaling.cpp).
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "nozzle_measure.hpp"
#include "pieces.hpp"
#include "unflex/compensate/run.hpp"
#include "unflex/planner/planner.hpp"
#include "unflex/timing/timing.hpp"

namespace unflex::timing {

// The move becomes no faster than it was sliced.
void bind_as_sliced(const planner::PlannedMove& move, MoveBounds& bounds);

// The nodes that a plan was measured at.
struct PlanNodes {
  double period_s = 0.0;
  std::vector<double> starts_s;  // of the plan's pieces, and the end of the last one
};

class ScaledLimits {
 public:
  // ends_rad: lengths of the pieces at both ends of a move, in 1/ω.
  ScaledLimits(const compensate::Course& course, const compensate::Setup& setup,
               std::span<const MoveBounds> bounds, std::span<const double> ends_rad);

  // The largest limits of the moves, and of the pieces.
  [[nodiscard]] const std::vector<MoveBounds>& allowed() const { return allowed_; }
  [[nodiscard]] const Pieces& pieces() const { return pieces_; }
  // Whether each piece keeps its timing.
  [[nodiscard]] const std::vector<bool>& is_kept() const { return is_kept_; }

  [[nodiscard]] std::vector<planner::PlannedMove> plan() const;

  // Scales the limits by the measure of a plan. swing: the largest one in the end, relative to its
  // allowance. repaired: repairs so far, this one included.
  void rescale(const std::vector<planner::PlannedMove>& plan, const NozzleMeasure& measured,
               const PlanNodes& nodes, double swing, int round, int repaired);
  // Lowers all limits. The engine has found no base, since the plan is too quick.
  void slow_down();

 private:
  // The largest values near each piece and near each vertex.
  struct Near {
    std::vector<double> piece;
    std::vector<double> vertex;
  };

  // How far a round goes.
  struct Step {
    double alpha = 0.0;
    double beta = 0.0;
    double most = 1.0;  // largest factor of a limit
    bool repairs = false;
    bool slows_for_width = false;  // an error of the width makes speeds smaller as well
  };
  // The largest values near a piece, relative to their aims.
  struct Errors {
    double g = 0.0;
    double width = 0.0;
    double ahead = 0.0;  // the nozzle's speed
  };

  // A part of a run keeps its timing where it meets its neighbours, since these are solved by
  // themselves.
  void keep_seams(const compensate::Course& course);
  void limit_accel(const compensate::Setup& setup);
  void limit_vertices(const compensate::Course& course, const compensate::Setup& setup);
  // Whether the moves on both sides of the vertex are to pass it as fast as sliced.
  [[nodiscard]] bool is_given(std::size_t vertex) const;
  [[nodiscard]] Near largest_near(const std::vector<double>& of_nodes, const PlanNodes& nodes,
                                  double reach_s) const;

  // Rescales the limit of a vertex that the plan passes at speed_mm_s.
  void rescale_vertex(std::size_t i, double speed_mm_s, double g, const Step& step);
  void rescale_piece(std::size_t i, const planner::PlannedMove& piece, const Errors& errors,
                     const Step& step);

  double omega_rad_s_;  // of the slowest mode
  std::vector<bool> is_kept_;
  std::vector<MoveBounds> allowed_;
  Pieces pieces_;
  std::vector<MoveBounds> bounds_;   // of the pieces, as scaled
  std::vector<double> vertex_mm_s_;  // largest speeds at vertices, as scaled
};

}  // namespace unflex::timing
