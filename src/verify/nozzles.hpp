// Nozzles of different dynamics on one base.
#pragma once

#include <vector>

#include "meter.hpp"
#include "unflex/verify/observer.hpp"

namespace unflex::verify {

// The nozzle of the rules, and those of the observation, which follow it.
class Nozzles {
 public:
  Nozzles(const NozzleModel& model, const Observation& observation, bool emitted)
      : main_(model), observer_(observation.observer) {
    for (const NozzleModel& other : observation.detuned) {
      // The same stretch of the path counts as near for all.
      detuned_.emplace_back(other, main_.reach_s());
    }
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
  void play(const planner::PlannedMove& move) {
    for_each([&](Meter& meter) { meter.play(move); });
  }
  void wait_for_reference() {
    for_each([](Meter& meter) { meter.wait_for_reference(); });
  }
  void hold(double duration_s) {
    for_each([&](Meter& meter) { meter.hold(duration_s); });
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

  Meter main_;
  std::vector<Meter> detuned_;
  Observer* observer_;
};

}  // namespace unflex::verify
