// Nozzles of different dynamics on one base.
//
// Under the printer's own shaper the base moves before the plan. Its present motion is known only
// once the plan is known some ms further. So the nozzles' clock stays behind the moves that have
// been played, across the ends of sections too, until the machine stands still.
#pragma once

#include <optional>
#include <vector>

#include "meter.hpp"
#include "unflex/verify/observer.hpp"

namespace unflex::verify {

// The nozzle of the rules (main) and those of the observation (detuned).
class Nozzles {
 public:
  // least_reach_s: as of Meter.
  Nozzles(const NozzleModel& model, const Observation& observation, NozzleBase base,
          double least_reach_s = 0.0);

  // From now on the observer is told that these nozzles hang on this base.
  void watch_as(NozzleBase base);
  // Keeps only main().
  void drop_detuned() { main_.drop_others(); }

  [[nodiscard]] const Meter& main() const { return main_; }
  [[nodiscard]] Meter& main() { return main_; }
  // The nozzles of the observation.
  [[nodiscard]] std::size_t detuned() const { return main_.others(); }
  [[nodiscard]] Deviation deviation_of_detuned(std::size_t number) const {
    return main_.deviation_of_other(number);
  }

  // The machine stands still, and another tool has been taken: main first, then those of the
  // observation.
  void set_models(const std::vector<NozzleModel>& models) {
    finish();
    main_.set_models(models);
  }
  // As Meter::set_machine().
  void set_machine(const MachineChange& change, const gcode::Position& at) {
    main_.set_machine(change, at);
  }

  // The clock of the moves that have been played; the nozzles are no further than that.
  [[nodiscard]] double plan_time_s() const;
  // Where the moves that have been played end.
  [[nodiscard]] XY plan_mm() const;

  void begin_section(ReferencePath& path);
  // Sets how the printer's own shaper changes the motion from now on.
  void shape(const planner::Shaping& shaping);
  void play(const planner::PlannedMove& move) { play(move, move); }
  // Plays a move whose filament comes out otherwise than it is pushed.
  void play(const planner::PlannedMove& laid, const planner::PlannedMove& pushed);
  // Plays the end of the shaped motion and returns how long the base moves after the plan's end.
  // Only what comes before that end is measured.
  double finish();
  // The base of an emitted section has come to its end, maybe before the reference. Shaped motion
  // goes on, so there is nothing to wait for.
  void wait_for_reference();
  // The machine stands still for duration_s. Motion that the shaper has delayed is played first.
  void hold(double duration_s);
  // Measures the line of plastic, too.
  void follow_line(const LineModel& model) { main_.follow_line(model); }
  void follow_lag(bool on) { main_.follow_lag(on); }
  void follow_feed(bool on) { main_.follow_feed(on); }

 private:
  void begin_shaped(const gcode::Position& from);
  void play_shaped(const std::vector<BasePhase>& phases);

  planner::Shaping shaping_;
  std::optional<ShapedBase> shaped_;  // set while motion is shaped
  double before_plan_s_ = 0.0;        // for how long shaped_ still moves before its first move
  double rested_s_ = 0.0;             // for how long the machine has stood still
  gcode::Position to_mm_{};           // end of the last move given to shaped_
  std::vector<BasePhase> phases_;
  Meter main_;
  Observer* observer_;
};

}  // namespace unflex::verify
