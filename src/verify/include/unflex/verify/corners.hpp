// How far a nozzle passes from the corners of a path. A nozzle that rounds a corner may stay near
// the path all the time, so the contour error does not show it.
//
// Notation:
//   corner   place where an extruding move in X and Y ends and the next move in X and Y, which
//            extrudes too, leaves in a direction more than 20° off; between them may be a stop
//   τ        reach: how far from its time a corner counts as near, s
//   corner distance   the smallest distance from the corner to p([t₁ − τ, t₂ + τ]), where the plan
//            reaches the corner at t₁ and leaves it at t₂
#pragma once

#include <cstddef>
#include <deque>
#include <limits>

#include "unflex/core/xy.hpp"
#include "unflex/planner/planner.hpp"
#include "unflex/verify/log_histogram.hpp"
#include "unflex/verify/measured.hpp"

namespace unflex::verify {

class CornerAccumulator {
 public:
  void add(double distance2_mm2, std::size_t line);
  [[nodiscard]] CornerStats stats() const;

 private:
  LogHistogram corners_;  // corners per cell
  double sum_distance2_ = 0.0;
  double distance2_max_ = 0.0;
  std::size_t count_ = 0;
  std::size_t line_ = 0;
};

// Holds the corners that the nozzle has not left behind yet.
class CornerGauge {
 public:
  explicit CornerGauge(double reach_s) : reach_s_(reach_s) {}

  // The next move of the path, and when the reference passes it. Moves come in their order, each
  // before the nozzle is within reach of its end.
  void follow(const planner::PlannedMove& move, double start_s, double end_s);
  // The nozzle is here at time_s. It has come straight from its last place, so samples must be
  // close together. Times must not decrease.
  void sample(double time_s, const XY& place_mm) {
    // A verification comes here at every step, mostly with no corner within reach.
    if (time_s < next_s_) {
      drawn_ = false;
    } else {
      look(time_s, place_mm);
    }
  }
  // Nobody looks at the nozzle at this time. Corners within reach now do not count, since the
  // nozzle may pass them unseen.
  void miss(double time_s);
  // Whether a corner is within reach.
  [[nodiscard]] bool is_near(double time_s) const { return time_s >= next_s_; }
  // Nothing is known of the nozzle's way from its last place to the next one.
  void lift() { drawn_ = false; }
  // Corners that the nozzle has come within reach of.
  [[nodiscard]] CornerStats stats() const;

 private:
  struct Corner {
    double from_s = 0.0;
    double until_s = 0.0;
    XY place_mm;
    double distance2_mm2 = 0.0;  // smallest so far
    std::size_t line = 0;
    bool missed = false;
  };

  void look(double time_s, const XY& place_mm);
  void let_go();
  void find_next();

  double reach_s_;
  // Corners by their times. If open_, the last one is the end of the last move. Only the next move
  // tells whether that end is a corner.
  std::deque<Corner> corners_;
  // The time from which the first corner counts; infinity if there is none.
  double next_s_ = std::numeric_limits<double>::infinity();
  bool open_ = false;
  gcode::Position end_mm_{};  // where the last move in X and Y has ended, and its direction
  XY direction_;
  bool drawn_ = false;  // the nozzle's last place is known
  XY last_mm_;
  CornerAccumulator left_behind_;
};

}  // namespace unflex::verify
