// How far the rate of filament in the output is from that in the sliced file at the same time.
//
// Notation:
//   s(t), o(t)   filament per second of the sliced file and of the output, mm/s; both linear in
//                time within a phase of a move
//   τ            10 ms
//   S(t), D(t)   integrals of s and of o − s over [t − τ, t]
//   D/S          the relative difference of the two mean rates
//
// The pressure in the nozzle follows the filament slowly, so single lines of 1 ms say nothing, and
// filament that comes a few ms late does little harm. What counts is a window of τ.
//
// A window counts only if the sliced file lays filament throughout. A travel or a rest in it would
// make S so small that next to no difference would look large.
//
// Two marks go along the phases, one at t and one at t − τ. As long as neither passes into another
// phase of either file, S and D are parabolas. Then the extremes of D/S are roots of a quadratic
// equation, since the cubic terms of D'S − DS' cancel.
#pragma once

#include <cstddef>
#include <deque>
#include <optional>

#include "unflex/planner/planner.hpp"
#include "unflex/verify/log_histogram.hpp"
#include "unflex/verify/verify.hpp"

namespace unflex::verify {

class FlowDifferenceGauge {
 public:
  static constexpr double kWindow_s = 0.01;

  // A run begins with the first move of the output. The first one of the sliced file follows
  // lead_in_s later.
  void begin_run(double lead_in_s);
  // The next move of either file; the two files may come in any order. Moves that are known of one
  // file only are held, so neither file should be far ahead.
  void play_sliced(const planner::PlannedMove& move);
  void play_output(const planner::PlannedMove& move);
  // All moves of the run are known. If the output ends first, it lays nothing for the rest of the
  // sliced file.
  void end_run();

  // Covers all runs so far; nullopt if no window was compared.
  [[nodiscard]] std::optional<FlowDifference> stats() const;

 private:
  // A quantity that is linear in time.
  struct Rate {
    double value = 0.0;  // where it begins
    double slope = 0.0;
    [[nodiscard]] Rate after(double t) const { return {value + slope * t, slope}; }
    [[nodiscard]] double integral(double t) const { return (value + 0.5 * slope * t) * t; }
  };
  // A phase of one file.
  struct Phase {
    double left_s = 0.0;
    Rate rate;
    std::size_t line = 0;
    bool lays = false;  // filament on a way in X or Y
  };
  // A time in which neither file changes its phase.
  struct Stretch {
    double left_s = 0.0;  // how long it lasts; of the front one, how much is still in the window
    Rate sliced;
    Rate difference;
    std::size_t line = 0;
  };

  static void append(const planner::PlannedMove& move, std::deque<Phase>& phases);
  static void append_rest(double duration_s, std::deque<Phase>& phases);
  void compare();
  void add(Stretch stretch);
  void go_on(const Rate& sliced, const Rate& difference, double duration_s);
  void look_at(double sliced_mm, double difference_mm, double later_s);
  [[nodiscard]] std::size_t line_in_middle(double later_s) const;
  void clear_window();

  std::deque<Phase> sliced_;
  std::deque<Phase> output_;
  std::deque<Stretch> window_;
  double filled_s_ = 0.0;       // how much of the first window is known
  double sliced_mm_ = 0.0;      // S
  double difference_mm_ = 0.0;  // D
  std::optional<FlowDifference> largest_;
  LogHistogram relative_s_;  // time per cell of |D/S|
};

}  // namespace unflex::verify
