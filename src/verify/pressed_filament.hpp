// The filament that comes out of the nozzle while the extruder turns.
//
// Notation:
//   E, V      filament pushed by the extruder, and filament that has come out, mm
//   q, r      V̇ and Ė(t − δ), mm/s; r is constant within a stretch
//   P, δ      dynamics::HotendPressure
//
// From P(q) = E(t − δ) − V follows P'(q) q̇ = r − q. Within a short part of a stretch P' counts as
// what it is in the middle, so q goes to r as e^(−t/P'). For linear pressure that is exact.
#pragma once

#include <deque>

#include "unflex/dynamics/hotend_pressure.hpp"

namespace unflex::verify {

class PressedFilament {
 public:
  PressedFilament() = default;
  explicit PressedFilament(const dynamics::HotendPressure& hotend);

  // Sets another pressure from now on. Filament that is already pressed together stays so.
  void set(const dynamics::HotendPressure& hotend);
  // The extruder pushes pushed_mm at even speed within duration_s. Returns the filament that comes
  // out meanwhile, in mm.
  [[nodiscard]] double push(double duration_s, double pushed_mm);
  // q at the end of the last stretch.
  [[nodiscard]] double flow_mm_s() const { return flow_mm_s_; }

 private:
  struct Stretch {
    double duration_s = 0.0;
    double rate_mm_s = 0.0;
  };
  [[nodiscard]] double follow(double duration_s, double rate_mm_s);
  [[nodiscard]] double follow_evenly(double duration_s, double rate_mm_s);

  dynamics::HotendPressure hotend_;
  double flow_mm_s_ = 0.0;
  // The turns of the extruder within the dead time, the oldest stretch first. All stretches
  // together last δ, since at the beginning a rest stands for the time before.
  std::deque<Stretch> on_the_way_;
};

}  // namespace unflex::verify
