// One axis of the machine as two points joined by a spring and a damper: the base, which the motor
// moves, and the nozzle, which hangs on it.
//
//   p̈ = 2ζω(ḃ − ṗ) + ω²(b − p)
//
//   b   base position, mm        p   nozzle position, mm
//   ω   natural frequency, rad/s  ζ   damping ratio
//
// Cisalpino (UFLA, 2023) eq. 3.17 and 3.18 with ζ = c/(2√(mk)); docs/theory.md lists where the
// printed forms differ.
#pragma once

namespace unflex::dynamics {

struct FlexibleAxis {
  double omega_rad_s = 282.743338823;  // 45 Hz
  double zeta = 0.06;
};

// ω = 2πf.
[[nodiscard]] FlexibleAxis from_frequency(double freq_hz, double damping_ratio);

// Position and velocity of the nozzle on one axis, mm and mm/s.
struct NozzleState {
  double position = 0.0;
  double velocity = 0.0;
};

// The nozzle on both axes.
struct NozzleXY {
  NozzleState x;
  NozzleState y;
};

// Motion of the base over one step of constant acceleration: b(t) = b0 + v0 t + a t²/2.
struct BaseSegment {
  double position = 0.0;      // b0, mm
  double velocity = 0.0;      // v0, mm/s
  double acceleration = 0.0;  // a, mm/s²
};

// One step of the classical fourth-order Runge–Kutta method, h seconds. The base is sampled exactly
// at the beginning, the middle and the end of the step.
[[nodiscard]] NozzleState rk4_step(const FlexibleAxis& axis, NozzleState state,
                                   const BaseSegment& base, double h);

// The exact state h seconds later under the same motion of the base, from the closed form of the
// damped oscillator (any ζ ≥ 0).
[[nodiscard]] NozzleState exact_step(const FlexibleAxis& axis, NozzleState state,
                                     const BaseSegment& base, double h);

// A step of a fixed length as a linear map, for many steps of that length.
class StepMap {
 public:
  // The base's position is carried along so that numbers stay small.
  [[nodiscard]] NozzleState step(const NozzleState& state, const BaseSegment& base) const {
    const double y = state.position - base.position;
    return {base.position + of_position_.position * y + of_velocity_.position * state.velocity +
                of_base_velocity_.position * base.velocity +
                of_base_acceleration_.position * base.acceleration,
            of_position_.velocity * y + of_velocity_.velocity * state.velocity +
                of_base_velocity_.velocity * base.velocity +
                of_base_acceleration_.velocity * base.acceleration};
  }

 protected:
  using OneStep = NozzleState (*)(const FlexibleAxis&, NozzleState, const BaseSegment&, double);
  StepMap(OneStep one_step, const FlexibleAxis& axis, double h);

 private:
  // The state after the step that one unit of each makes.
  NozzleState of_position_;
  NozzleState of_velocity_;
  NozzleState of_base_velocity_;
  NozzleState of_base_acceleration_;
};

// rk4_step() as a map.
class Rk4Map : public StepMap {
 public:
  Rk4Map(const FlexibleAxis& axis, double h);
};

// exact_step() as a map.
class ExactMap : public StepMap {
 public:
  ExactMap(const FlexibleAxis& axis, double h);
};

}  // namespace unflex::dynamics
