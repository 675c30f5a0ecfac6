// Nozzles of different dynamics on one base.
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "meter.hpp"
#include "unflex/verify/observer.hpp"

namespace unflex::verify {

// The nozzle of the rules (main) and those of the observation (detuned).
class Nozzles {
 public:
  Nozzles(const NozzleModel& model, const Observation& observation, bool emitted)
      : main_(model), observer_(observation.observer) {
    for (const NozzleModel& other : observation.detuned) {
      // One reach for all, so that one stretch of the path counts as near for all.
      detuned_.emplace_back(other, main_.reach_s());
    }
    main_.follow_filament();
    if (observer_ != nullptr) {
      std::size_t number = 0;
      for_each([&](Meter& meter) { meter.watch(observer_, {emitted, number++}); });
    }
  }

  [[nodiscard]] const Meter& main() const { return main_; }
  [[nodiscard]] Meter& main() { return main_; }
  [[nodiscard]] const std::vector<Meter>& detuned() const { return detuned_; }

  void begin_section(ReferencePath& path) {
    for_each([&](Meter& meter) { meter.begin_section(path); });
  }
  // Sets how the printer's own shaper changes the motion from now on.
  void shape(const planner::Shaping& shaping) {
    finish_shaped();
    shaping_ = shaping;
  }
  void play(const planner::PlannedMove& move) {
    if (!shaping_.acts()) {
      for_each([&](Meter& meter) { meter.play(move); });
      return;
    }
    const gcode::Position& from = move.segment.start_mm;
    if (!shaped_ || from[gcode::X] != to_mm_[gcode::X] || from[gcode::Y] != to_mm_[gcode::Y]) {
      finish_shaped();
      for_each([&](Meter& meter) { meter.shift_to(from[gcode::X], from[gcode::Y]); });
      shaped_.emplace(shaping_, from[gcode::X], from[gcode::Y]);
    }
    to_mm_ = move.segment.end_mm;
    phases_.clear();
    shaped_->add(move, phases_);
    for (const BasePhase& phase : phases_) {
      for_each([&](Meter& meter) { meter.play(phase); });
    }
  }
  void wait_for_reference() {
    for_each([](Meter& meter) { meter.wait_for_reference(); });
  }
  // The machine stands still for duration_s. Motion that the shaper has delayed is played first.
  void hold(double duration_s) {
    const double rest_s = std::max(0.0, duration_s - finish_shaped());
    for_each([&](Meter& meter) { meter.hold(rest_s); });
  }
  void follow_lag(bool on) { main_.follow_lag(on); }

 private:
  template <class Action>
  void for_each(Action action) {
    action(main_);
    for (Meter& meter : detuned_) {
      action(meter);
    }
  }

  // Plays the end of the shaped motion and returns how long that takes.
  double finish_shaped() {
    double duration_s = 0.0;
    if (shaped_) {
      phases_.clear();
      shaped_->finish(phases_);
      for (const BasePhase& phase : phases_) {
        for_each([&](Meter& meter) { meter.settle(phase); });
        duration_s += phase.duration_s;
      }
      shaped_.reset();
    }
    return duration_s;
  }

  planner::Shaping shaping_;
  std::optional<ShapedBase> shaped_;  // set while motion is shaped
  gcode::Position to_mm_{};           // end of the last move given to shaped_
  std::vector<BasePhase> phases_;
  Meter main_;
  std::vector<Meter> detuned_;
  Observer* observer_;
};

}  // namespace unflex::verify
