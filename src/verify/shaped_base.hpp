// The base's motion while the printer's own input shaper is on.
//
//   b_s(t) = Σ A_i b(t − d_i)     per axis; the pulses' delays counted from the first of them
//
// Planned motion has phases of constant acceleration, and so has shaped motion: a phase ends
// wherever a delayed phase ends. The firmware shifts the pulses by their mean delay, so this motion
// comes some ms later than the firmware's. Distances from the path do not depend on that.
#pragma once

#include <array>
#include <cstddef>
#include <deque>
#include <vector>

#include "unflex/dynamics/flexible_axis.hpp"
#include "unflex/planner/planner.hpp"
#include "unflex/planner/printer_shaper.hpp"

namespace unflex::verify {

// Both axes during a time in which neither changes its acceleration.
struct BasePhase {
  dynamics::BaseSegment x;
  dynamics::BaseSegment y;
  // Filament that comes out meanwhile. Zero for a shaped base, whose filament is not shaped.
  dynamics::BaseSegment e = {};
  double duration_s = 0.0;
};

// Appends the phases of one move, except those without duration.
void append_phases(const planner::PlannedMove& move, std::vector<BasePhase>& phases);

class ShapedBase {
 public:
  // The base rests at x, y.
  ShapedBase(const planner::Shaping& shaping, double x_mm, double y_mm);

  // Takes the next move and appends the shaped motion that is known by then. It lasts as long as
  // the motion given so far.
  void add(const planner::PlannedMove& move, std::vector<BasePhase>& shaped);
  // The machine stands still. Appends what is left of the shaped motion.
  void finish(std::vector<BasePhase>& shaped);

 private:
  struct Tap {
    double delay_s = 0.0;
    double weight = 0.0;
    std::size_t index = 0;  // phase that the tap has reached, counted from the very first
  };
  struct Timed {
    double start_s = 0.0;
    BasePhase phase;
  };

  void give(const BasePhase& phase);
  void advance(std::vector<BasePhase>& shaped);
  [[nodiscard]] double next_change(std::vector<Tap>& taps);
  [[nodiscard]] dynamics::BaseSegment sum(const std::vector<Tap>& taps,
                                          dynamics::BaseSegment BasePhase::*axis) const;

  std::vector<Tap> x_;
  std::vector<Tap> y_;
  double memory_s_ = 0.0;
  std::deque<Timed> given_;
  std::size_t forgotten_ = 0;
  double given_until_s_ = 0.0;
  double time_s_ = 0.0;  // end of the shaped motion so far
};

}  // namespace unflex::verify
