// Filament between the extruder's gear and the nozzle's mouth: it is pressed together, and so what
// comes out follows the extruder late.
//
//   P(q) = E(t − δ) − V        q = V̇
//
//   E   filament that the extruder has pushed, mm      V   filament that has come out, mm
//   q   flow, mm of filament per s                     δ   dead time, s
//   P   filament that is pressed together, mm: odd, and rising with q
//
// P(q) = K q is what Klipper, Marlin and RepRapFirmware call linear pressure advance. Two slopes
// are RepRapFirmware's (M572 S:S2), tanh and reciprocal are Kalico's (docs/Config_Reference.md,
// pressure_advance_model).
#pragma once

namespace unflex::dynamics {

enum class PressureShape {
  linear,      // K q
  two_slopes,  // K q, beyond q₀ with the second slope
  tanh,        // K q + O tanh(q/q₀)
  reciprocal,  // K q + O (1 − 1/(1 + q/q₀))
};

struct HotendPressure {
  PressureShape shape = PressureShape::linear;
  double advance_s = 0.0;         // K; 0: nothing is pressed together
  double offset_mm = 0.0;         // O
  double knee_mm_s = 1.0;         // q₀
  double second_advance_s = 0.0;  // slope beyond the knee of two slopes
  double dead_time_s = 0.0;       // δ

  // P(q), mm.
  [[nodiscard]] double pressed_mm(double flow_mm_s) const;
  // P'(q), s.
  [[nodiscard]] double slope_s(double flow_mm_s) const;
  // This pressure, multiplied by `times`.
  [[nodiscard]] HotendPressure scaled(double times) const;

  friend bool operator==(const HotendPressure&, const HotendPressure&) = default;
};

}  // namespace unflex::dynamics
