// Values that follow from others while their own key is unset.
//
// The extruder's follow Klipper's [extruder] section (docs/Config_Reference.md there):
//   S_max = 4 d²                     d  nozzle diameter
//   v_max = V · 4 d² / (π D² / 4)    D  filament diameter, V  max_velocity
//   a_max = A · 4 d² / (π D² / 4)    A  max_accel
// v_max and a_max use the default cross-section even where another one is configured.

#include <algorithm>
#include <numbers>

#include "unflex/machine/machine.hpp"

namespace unflex::machine {
namespace {

// Filament per path length at the default cross-section.
double default_extrude_ratio(const ExtruderSettings& extruder) {
  const double nozzle = extruder.nozzle_diameter_mm;
  const double filament = extruder.filament_diameter_mm;
  return 4.0 * nozzle * nozzle / (std::numbers::pi * filament * filament / 4.0);
}

// The zero of the axis' transfer function lies at −ω/2ζ; after four of its time constants, 8ζ/ω,
// what the base still does is below a fiftieth.
double settling_time_s(const AxisDynamics& axis) {
  return 8.0 * axis.damping_ratio / (2.0 * std::numbers::pi * axis.freq_hz);
}

}  // namespace

double Settings::max_z_velocity_mm_s() const {
  return limits.max_z_velocity_mm_s.value_or(limits.max_velocity_mm_s);
}

double Settings::max_z_accel_mm_s2() const {
  return limits.max_z_accel_mm_s2.value_or(limits.max_accel_mm_s2);
}

double Settings::max_extrude_cross_section_mm2() const {
  return extruder.max_extrude_cross_section_mm2.value_or(4.0 * extruder.nozzle_diameter_mm *
                                                         extruder.nozzle_diameter_mm);
}

double Settings::max_extrude_only_velocity_mm_s() const {
  return extruder.max_extrude_only_velocity_mm_s.value_or(limits.max_velocity_mm_s *
                                                          default_extrude_ratio(extruder));
}

double Settings::max_extrude_only_accel_mm_s2() const {
  return extruder.max_extrude_only_accel_mm_s2.value_or(limits.max_accel_mm_s2 *
                                                        default_extrude_ratio(extruder));
}

double Settings::base_max_velocity_mm_s() const {
  return base.max_velocity_mm_s.value_or(2.0 * limits.max_velocity_mm_s);
}

double Settings::base_max_accel_mm_s2() const {
  return base.max_accel_mm_s2.value_or(4.0 * limits.max_accel_mm_s2);
}

double Settings::tail_s() const {
  constexpr double kShortest = 2e-3;
  if (solve.tail_ms) {
    return *solve.tail_ms * 1e-3;
  }
  return std::max({kShortest, settling_time_s(dynamics_x), settling_time_s(dynamics_y)});
}

double Settings::tolerance_um() const {
  constexpr double kPerHz = 0.3 / 45.0;
  return emit.tolerance_um.value_or(kPerHz * std::min(dynamics_x.freq_hz, dynamics_y.freq_hz));
}

double Settings::shaper_freq_x_hz() const {
  return printer.input_shaper_freq_x_hz.value_or(dynamics_x.freq_hz);
}

double Settings::shaper_freq_y_hz() const {
  return printer.input_shaper_freq_y_hz.value_or(dynamics_y.freq_hz);
}

}  // namespace unflex::machine
