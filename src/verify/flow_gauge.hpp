// How much filament a file has the hotend melt per second, and how fast that changes.
//
// Notation:
//   v(t)   volume of filament per second; linear in time within a phase of a move
//   τ      20 ms
//   m(t)   mean of v over [t − τ, t],                  ṁ = (v(t) − v(t − τ))/τ
//   c(t)   its change, c = (m(t) − m(t − τ))/τ,        ċ = (v(t) − 2v(t − τ) + v(t − 2τ))/τ²
//
// The flow of a file is m, not v: a line of 1 ms has its filament rounded, and a firmware changes
// the speed from line to line at once, so v jumps. Neither the melting nor the pressure in the
// nozzle follows within 20 ms.
//
// Three marks go along the phases: one at t, one at t − τ, one at t − 2τ. As long as none of them
// passes into another phase, m and c are parabolas, so their extremes are exact.
#pragma once

#include <cstddef>
#include <deque>

#include "unflex/planner/planner.hpp"
#include "unflex/verify/verify.hpp"

namespace unflex::verify {

class FlowGauge {
 public:
  static constexpr double kMean_s = 0.02;

  explicit FlowGauge(double filament_area_mm2);

  // Only moves in X or Y that lay filament have a flow. All other moves, such as retractions, take
  // time without a flow.
  void play(const planner::PlannedMove& move);
  void rest(double duration_s);

  // Since the beginning.
  [[nodiscard]] const FlowStats& stats() const { return stats_; }
  // The largest flow since begin_section().
  void begin_section() { section_ = {}; }
  [[nodiscard]] const FlowStats& section() const { return section_; }

 private:
  struct Stretch {
    double duration_s = 0.0;
    double flow_mm3_s = 0.0;  // where it begins
    double slope_mm3_s2 = 0.0;
    std::size_t line = 0;
  };
  // A place on the stretches.
  struct Mark {
    std::size_t stretch = 0;
    double left_s = 0.0;  // until the stretch ends
    double flow_mm3_s = 0.0;
  };

  void add(const Stretch& stretch);
  void go_on(double duration_s);
  void pass(Mark& mark, double duration_s);
  void look_at_mean(double mean_mm3_s);
  void look_at_change(double change_mm3_s2, std::size_t line);

  double filament_area_mm2_;
  std::deque<Stretch> stretches_;  // from the last mark to the first
  Mark now_;
  Mark before_;      // τ ago
  Mark far_before_;  // 2τ ago, always on the first stretch
  double mean_mm3_s_ = 0.0;
  double change_mm3_s2_ = 0.0;
  std::size_t line_ = 0;  // last one that moved
  FlowStats stats_;
  FlowStats section_;
};

}  // namespace unflex::verify
