// The tower that unflex tune --pressure has printed: a hollow square whose walls are slow at both
// ends and fast between them. Each of its bands is made for a hotend of another advance or dead
// time.
//
//   ╭──── corner, slow ──── slow ─┼─ fast ─┼─ slow ──── corner, slow ────╮
//
// Where a band is made for the printer's own hotend, the wall is even where the speed changes. If
// the advance is too small, it is thin behind the first mark and thick behind the second.
#pragma once

#include <optional>
#include <string>

#include "unflex/core/error.hpp"
#include "unflex/tune/pressure_trial.hpp"
#include "unflex/tune/tower.hpp"

namespace unflex::tune {

struct PressureTowerSettings : TowerPrinter {
  PressureTrial trial;
  double own_advance_s = 0.0;  // the printer's own, which is set again behind the tower
  std::optional<double> max_flow_mm3_s = {};  // what the hotend melts
};

// The largest acceleration of a tower of this trial, mm/s², if the extruder accelerates filament by
// no more than `extruder_mm_s2`. Where the speed begins to change, the extruder has to come up to K
// q̇ at once.
[[nodiscard]] double followed_accel_mm_s2(const PressureTowerSettings& settings,
                                          double extruder_mm_s2);

// The parts of each wall, one behind the other, and their speeds.
struct PressureWall {
  double slow_mm_s = 0.0;
  double fast_mm_s = 0.0;
  double slow_mm = 0.0;  // length of the slow part at either end
  double fast_mm = 0.0;  // of the fast part, with the ways it takes to change the speed
};
[[nodiscard]] PressureWall pressure_wall(const PressureTowerSettings& settings);

// The tower as a slicer would write it, not compensated.
[[nodiscard]] Tower tower(const PressureTowerSettings& settings);

// Whether the file of a tower says that it is of this kind.
[[nodiscard]] bool is_pressure_tower(const std::string& text);

// The facts that the file of such a tower tells. An error of kind input if the file is no such
// tower.
struct PressureTowerRecord {
  PressureTrial trial;
  Codes codes;
};
[[nodiscard]] Result<PressureTowerRecord> pressure_record_of(const std::string& text,
                                                             const std::string& name);

}  // namespace unflex::tune
