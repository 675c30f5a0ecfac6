// The base's motion while the printer's own input shaper is on.
//
//   b_s(t) = Σ A_i b(t − t_i)     per axis, t on the clock of the plan
//   D      the lead: by how much the first t_i of both axes lies before 0
//
// Planned motion has phases of constant acceleration, and so has shaped motion: a phase ends
// wherever a shifted phase ends. b_s(t) is known once the plan is known until t + D. Filament is
// not shaped.
#pragma once

#include <algorithm>
#include <cstddef>
#include <deque>
#include <vector>

#include "unflex/dynamics/flexible_axis.hpp"
#include "unflex/planner/planner.hpp"
#include "unflex/planner/printer_shaper.hpp"

namespace unflex::verify {

// Both axes during a time in which neither changes its acceleration.
struct BasePhase {
  dynamics::BaseXY xy;
  dynamics::BaseSegment z = {};
  // Filament that comes out meanwhile, counted from the start of the move or of the shaped motion.
  dynamics::BaseSegment e = {};
  // Filament that the extruder pushes in moves of X or Y, without wipes. It may draw some back
  // where it pushes other filament than comes out. Its place has no meaning.
  dynamics::BaseSegment pushed = {};
  double duration_s = 0.0;
  bool extruding = false;  // the move lays filament
};

// The base that stands still at a place.
[[nodiscard]] dynamics::BaseXY resting_at(const XY& place_mm);

// Appends the phases of one move, except those without duration. pushed_mm: what the extruder
// pushes meanwhile, if that is not what comes out.
void append_phases(const planner::PlannedMove& move, double pushed_mm,
                   std::vector<BasePhase>& phases);

class ShapedBase {
 public:
  // The base rests at this place.
  ShapedBase(const planner::Shaping& shaping, const XY& place_mm);

  // Takes the next move and appends the shaped motion that is known by then. Shaped motion begins
  // lead_s() before the first move, so it lasts as long as the motion given so far. A phase ends
  // where the first move begins.
  void add(const planner::PlannedMove& move, std::vector<BasePhase>& shaped);
  // The machine stands still. Appends the rest of the shaped motion: until the plan's end, and
  // behind it.
  void finish(std::vector<BasePhase>& until_end, std::vector<BasePhase>& behind);

  // D.
  [[nodiscard]] double lead_s() const { return lead_s_; }
  // Duration of the given moves that the shaped motion has not reached yet.
  [[nodiscard]] double unplayed_s() const { return std::min(lead_s_, given_until_s_); }
  // Filament that the given moves lay.
  [[nodiscard]] double filament_mm() const { return filament_mm_; }

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
  void rest(double duration_s, std::vector<BasePhase>& shaped);
  void advance(std::vector<BasePhase>& shaped);
  [[nodiscard]] double next_change(std::vector<Tap>& taps);
  // part: what of a phase the taps add up.
  template <typename Part>
  [[nodiscard]] dynamics::BaseSegment sum(const std::vector<Tap>& taps, const Part& part) const;

  Axes<std::vector<Tap>> xy_;
  std::vector<Tap> e_;
  double lead_s_ = 0.0;
  double memory_s_ = 0.0;
  double filament_mm_ = 0.0;
  std::deque<Timed> given_;
  std::size_t forgotten_ = 0;
  double given_until_s_ = 0.0;
  double time_s_ = 0.0;  // end of the shaped motion so far, counted from its beginning
};

}  // namespace unflex::verify
