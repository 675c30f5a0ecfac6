// The printer's own input shaper: how it changes the motion that unflex leaves to it, and how long
// the machine stands still when a line switches the shaper.
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

// The shaper's effect on the motion of each axis. Without pulses the motion stays as it is.
//
//   b_s(t) = Σ A_i b(t − t_i)     t on the clock of the plan
//
// Klipper shifts the pulses of each axis so that Σ A_i t_i = 0 (kin_shaper.c, shift_pulses). X and
// Y stay in step at constant speed, whatever their shapers are, and the machine moves before the
// plan. Marlin plays the plan at once and the second pulse later (stepper.cpp, pulse_phase_isr);
// RepRapFirmware delays all pulses but the first, too. Where the axes' shapers differ, X and Y are
// then out of step.
struct Shaping : Axes<dynamics::ShaperPulses> {
  [[nodiscard]] bool acts() const {
    return any_axis([](const dynamics::ShaperPulses& pulses) { return !pulses.empty(); }, *this);
  }
  // The longest time by which the machine moves before the plan.
  [[nodiscard]] double lead_s() const;
  // The longest time by which the machine moves before a motion begins or after it ends.
  [[nodiscard]] double reach_s() const;
  // Time from the first pulse to the last.
  [[nodiscard]] double length_s() const;
};

// The pulses of the shaper. Types and damping ratios that the file has not set are taken from the
// configuration. An unknown type counts as the firmware's default.
[[nodiscard]] Shaping shaping(const FirmwareConfig& config, const gcode::Shaper& shaper);

// The firmware's pressure advance in force.
struct FirmwareAdvance {
  double advance_s = 0.0;
  double smooth_s = 0.0;  // Klipper's smooth time; 0 if the advance is 0

  friend bool operator==(const FirmwareAdvance&, const FirmwareAdvance&) = default;
};

// The advance in force. Values that the file has not set are the configuration's.
[[nodiscard]] FirmwareAdvance advance_in_force(const FirmwareConfig& config,
                                               const gcode::PressureAdvance& of_file);

// The filters of a printer's steps.
struct Filters {
  gcode::Shaper shaper;
  gcode::PressureAdvance advance = {};
};

// The shortest time that the machine stands still when a line changes the filters. 0 if they do not
// change.
//
// Klipper generates all steps of what is queued. This takes as long as its filters look ahead and
// back, once with the old settings and once with the new ones (flush_all_steps,
// calc_step_gen_restart):
//   stop = d(before) + d(after),   d = max(1 ms, reach of the shaper, half of the smooth time of
//   pressure advance)
// Klipper does so for a new smooth time too. The smooth time is 0 if pressure advance is 0
// (kinematics/extruder.py, _set_pressure_advance).
// Marlin waits until the delayed part of the motion is over. RepRapFirmware waits for it too, and
// starts from standstill when it has waited 10 ms for further lines (Configuration.h,
// DefaultGracePeriod).
[[nodiscard]] double switching_s(const FirmwareConfig& config, const Filters& before,
                                 const Filters& after);

}  // namespace unflex::planner
