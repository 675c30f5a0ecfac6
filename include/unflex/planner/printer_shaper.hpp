// The printer's own input shaper: what it makes of the motion that unflex leaves to it, and for how
// long the machine stands still when it is switched.
//
// Sources: Klipper (August 2026) klippy/extras/input_shaper.py, klippy/toolhead.py,
// klippy/extras/motion_queuing.py, klippy/chelper/kin_shaper.c; Marlin 2.1.2 src/module/stepper.cpp
// (set_shaping_frequency, set_shaping_damping_ratio); RepRapFirmware 3.6
// src/Movement/AxisShaper.cpp.
#pragma once

#include <optional>

#include "unflex/dynamics/shapers.hpp"
#include "unflex/gcode/interpreter.hpp"
#include "unflex/planner/planner.hpp"

namespace unflex::planner {

// What the shaper makes of the motion of each axis. Without pulses it leaves the axis as it is.
struct Shaping {
  dynamics::ShaperPulses x;
  dynamics::ShaperPulses y;

  [[nodiscard]] bool acts() const { return !x.empty() || !y.empty(); }
  // For how long after the end of a motion the machine still moves, and before its begin already.
  [[nodiscard]] double reach_s() const;
  // From the first pulse to the last.
  [[nodiscard]] double length_s() const;
};

// The pulses of this shaper. Of types and damping ratios that the file has not set, those
// of the configuration hold. A type that is not known counts as the firmware's default.
[[nodiscard]] Shaping shaping(const FirmwareConfig& config, const gcode::Shaper& shaper);

// How long the machine stands still, at least, where a line turns the first of these shapers into
// the second. 0 where they are the same.
//
// Klipper generates all steps of what is queued, which takes as long as its filters look ahead and
// back, once by the old settings and once by the new (flush_all_steps, calc_step_gen_restart):
//   stop = d(before) + d(after),   d = max(1 ms, reach of the shaper, half of the smooth time of
//   pressure advance)
// Marlin waits until the delayed part of the motion is over. RepRapFirmware does as well, and
// starts from standstill when it has waited 10 ms for further lines (Configuration.h,
// DefaultGracePeriod). pressure_advance_s: the one in force, where the file says so; otherwise the
// configuration's is.
[[nodiscard]] double switching_s(const FirmwareConfig& config, const gcode::Shaper& before,
                                 const gcode::Shaper& after,
                                 std::optional<double> pressure_advance_s);

}  // namespace unflex::planner
