// One axis of the machine: the base, which the motor moves, and the nozzle, which hangs on it by a
// spring and a damper, or by several.
//
//   p = Σ q_i        q̈_i = 2ζ_i ω_i (g_i ḃ − q̇_i) + ω_i² (g_i b + τ_i ḃ − q_i)
//   Σ g_i = 1        Σ τ_i = 0
//
//   b   base position, mm          p   nozzle position, mm          i   modes
//   ω   natural frequency, rad/s   ζ   damping ratio                g   gain, of either sign
//   q   the mode's part of p       τ   lead, s: 0 but for modes behind each other
//
// With one mode: Cisalpino (UFLA, 2023) eq. 3.17 and 3.18 with ζ = c/(2√(mk)); docs/theory.md lists
// where the printed forms differ. Several modes are the modal form of a base-excited structure
// (Meirovitch, Fundamentals of Vibrations, § 7.7).
//
// Other modules ask the axis and its states. They do not read modes, unless they take the equation
// above apart.
#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <span>
#include <vector>

#include "unflex/core/axes.hpp"
#include "unflex/core/xy.hpp"

namespace unflex::dynamics {

// The most modes that an axis can have.
inline constexpr std::size_t kMostModes = 3;

struct Mode {
  double omega_rad_s = 282.743338823;  // 45 Hz
  double zeta = 0.06;
  double gain = 1.0;
  double lead_s = 0.0;

  // ω² and 2ζω, before the gain.
  [[nodiscard]] constexpr double stiffness_per_s2() const { return omega_rad_s * omega_rad_s; }
  [[nodiscard]] constexpr double damping_per_s() const { return 2.0 * zeta * omega_rad_s; }
};

// Position and velocity of the nozzle on one axis, mm and mm/s.
struct NozzleMotion {
  double position = 0.0;
  double velocity = 0.0;
};

using NozzleMotionXY = Axes<NozzleMotion>;
[[nodiscard]] inline XY place_mm(const NozzleMotionXY& nozzle) {
  return map_axes([](const NozzleMotion& of_axis) { return of_axis.position; }, nozzle);
}
[[nodiscard]] inline XY velocity_mm_s(const NozzleMotionXY& nozzle) {
  return map_axes([](const NozzleMotion& of_axis) { return of_axis.velocity; }, nozzle);
}

// All that determines the nozzle's motion on one axis, once the base's motion is given: q_i and its
// velocity. States of the same axis may be added up and scaled.
struct NozzleState {
  std::array<NozzleMotion, kMostModes> parts{};  // zero where the axis has fewer modes

  [[nodiscard]] double position() const {
    return parts[0].position + parts[1].position + parts[2].position;
  }
  [[nodiscard]] double velocity() const {
    return parts[0].velocity + parts[1].velocity + parts[2].velocity;
  }
  [[nodiscard]] NozzleMotion motion() const { return {position(), velocity()}; }

  // Adds `times` the other state.
  void add(const NozzleState& other, double times = 1.0) {
    for (std::size_t i = 0; i < kMostModes; ++i) {
      parts[i].position += times * other.parts[i].position;
      parts[i].velocity += times * other.parts[i].velocity;
    }
  }
};
static_assert(kMostModes == 3, "NozzleState adds up three parts");

// The nozzle on both axes, and its place, mm.
using NozzleXY = Axes<NozzleState>;
[[nodiscard]] inline NozzleMotionXY motion(const NozzleXY& nozzle) {
  return map_axes([](const NozzleState& state) { return state.motion(); }, nozzle);
}
[[nodiscard]] inline XY place_mm(const NozzleXY& nozzle) {
  return map_axes([](const NozzleState& state) { return state.position(); }, nozzle);
}

// Motion of the base over one step of constant acceleration: b(t) = b0 + v0 t + a t²/2.
struct BaseSegment {
  double position = 0.0;      // b0, mm
  double velocity = 0.0;      // v0, mm/s
  double acceleration = 0.0;  // a, mm/s²
};

// The base on both axes.
using BaseXY = Axes<BaseSegment>;
[[nodiscard]] inline XY place_mm(const BaseXY& base) {
  return map_axes([](const BaseSegment& of_axis) { return of_axis.position; }, base);
}
[[nodiscard]] inline XY velocity_mm_s(const BaseXY& base) {
  return map_axes([](const BaseSegment& of_axis) { return of_axis.velocity; }, base);
}

class FlexibleAxis {
 public:
  constexpr FlexibleAxis() = default;
  // One mode.
  constexpr FlexibleAxis(double omega_rad_s, double zeta) : modes_{Mode{omega_rad_s, zeta}} {}
  // 1 to kMostModes modes, whose gains add up to 1.
  explicit FlexibleAxis(std::span<const Mode> modes);

  [[nodiscard]] std::span<const Mode> modes() const { return {modes_.data(), count_}; }
  [[nodiscard]] std::size_t mode_count() const { return count_; }
  // The mode with the largest gain, for what knows one mode only: shapers and older methods.
  [[nodiscard]] const Mode& main() const;
  [[nodiscard]] double main_hz() const;
  [[nodiscard]] double main_rad_s() const { return main().omega_rad_s; }
  [[nodiscard]] double main_damping_ratio() const { return main().zeta; }

  [[nodiscard]] double slowest_rad_s() const;
  [[nodiscard]] double fastest_rad_s() const;
  // In this time every swing dies away to a fiftieth.
  [[nodiscard]] double settling_s() const;
  // The longest 1/(4ζω), which is the integral of the square of a swing of amplitude 1. A ζ below
  // least_zeta counts as least_zeta.
  [[nodiscard]] double ringing_s(double least_zeta) const;
  // The slowest rate at which a free motion dies away, 1/s.
  [[nodiscard]] double decay_per_s() const;
  // The largest distance between base and nozzle, mm. Either both have this constant acceleration,
  // or the base has this speed and dampers hold the nozzle.
  [[nodiscard]] double largest_lag_mm(double accel_mm_s2, double velocity_mm_s) const;
  // The nozzle's acceleration when the base is 1 mm ahead, Σ gω², and when the base is 1 mm/s
  // faster, Σ 2gζω. These two alone decide the nozzle's response to a push that is short against
  // all periods.
  [[nodiscard]] double stiffness_per_s2() const;
  [[nodiscard]] double damping_per_s() const;

  // The zeros of the transfer function from base to nozzle, rad/s: while the base moves as e^{st}
  // with s at a zero, the nozzle rests. Those at infinity are left out.
  [[nodiscard]] std::vector<std::complex<double>> zeros() const;
  // Some motions of the base leave the nozzle at rest. This is the time in which they die away to
  // 10⁻⁵. With one mode they die at once. With several modes there is such a motion near each
  // antiresonance.
  [[nodiscard]] double unseen_s() const;

  // The axis with a mode that hangs behind its nozzle: p̈₂ = 2ζω(ṗ − ṗ₂) + ω²(p − p₂), by the
  // partial fractions of the product of both transfer functions. The axis must have room for a mode
  // more, and none like it.
  [[nodiscard]] FlexibleAxis followed_by(double omega_rad_s, double zeta) const;
  // The axis with all frequencies and all damping ratios times these factors.
  [[nodiscard]] FlexibleAxis detuned(double freq_factor, double damping_factor = 1.0) const;

  // The state of a nozzle that has followed a base in even motion for a long time.
  [[nodiscard]] NozzleState riding(double position_mm, double velocity_mm_s = 0.0) const;
  // The state of this axis with the swing that `nozzle` has. `nozzle` is a state of `other` while
  // the base is at base_mm.
  [[nodiscard]] NozzleState swinging_as(const FlexibleAxis& other, const NozzleState& nozzle,
                                        double base_mm) const;
  // The difference between two states as places: Σ |Δq| and Σ |Δq̇|/ω, mm.
  struct Gap {
    double place_mm = 0.0;
    double speed_mm = 0.0;
  };
  [[nodiscard]] Gap gap(const NozzleState& a, const NozzleState& b) const;

 private:
  std::array<Mode, kMostModes> modes_{};
  std::size_t count_ = 1;
};

// One mode, ω = 2πf.
[[nodiscard]] FlexibleAxis from_frequency(double freq_hz, double damping_ratio);

// One step of the classical fourth-order Runge–Kutta method, h seconds. The base is sampled exactly
// at the beginning, the middle and the end of the step. The verifier does it for several nozzles at
// once (src/verify/bundle_lanes.hpp).
[[nodiscard]] NozzleState rk4_step(const FlexibleAxis& axis, const NozzleState& state,
                                   const BaseSegment& base, double h);

// The exact state h seconds later under the same motion of the base, from the closed form of the
// damped oscillator (any ζ ≥ 0).
[[nodiscard]] NozzleState exact_step(const FlexibleAxis& axis, const NozzleState& state,
                                     const BaseSegment& base, double h);

// exact_step() of a fixed length as a linear map, for many steps of that length.
class ExactMap {
 public:
  ExactMap(const FlexibleAxis& axis, double h);

  // The base's position is carried along so that numbers stay small.
  void advance(const BaseSegment& base, NozzleState& state) const {
    for (std::size_t i = 0; i < count_; ++i) {
      const OfMode& map = maps_[i];
      NozzleMotion& part = state.parts[i];
      const double place = map.gain * base.position;
      const double y = part.position - place;
      part = {place + map.of_position.position * y + map.of_velocity.position * part.velocity +
                  map.of_base_velocity.position * base.velocity +
                  map.of_base_acceleration.position * base.acceleration,
              map.of_position.velocity * y + map.of_velocity.velocity * part.velocity +
                  map.of_base_velocity.velocity * base.velocity +
                  map.of_base_acceleration.velocity * base.acceleration};
    }
  }

 private:
  // A mode's part after one step, per unit of each quantity.
  struct OfMode {
    double gain = 1.0;
    NozzleMotion of_position;
    NozzleMotion of_velocity;
    NozzleMotion of_base_velocity;
    NozzleMotion of_base_acceleration;
  };
  std::array<OfMode, kMostModes> maps_;
  std::size_t count_ = 1;
};

// The slowest mode of all axes.
[[nodiscard]] inline double slowest_rad_s(const Axes<FlexibleAxis>& axes) {
  return least_of_axes([](const FlexibleAxis& axis) { return axis.slowest_rad_s(); }, axes);
}

// The state of a nozzle that has followed a base in even motion on all axes for a long time.
[[nodiscard]] inline NozzleXY riding(const Axes<FlexibleAxis>& axes, const XY& position_mm,
                                     const XY& velocity_mm_s = {}) {
  return map_axes([](const FlexibleAxis& axis, double place_mm,
                     double speed_mm_s) { return axis.riding(place_mm, speed_mm_s); },
                  axes, position_mm, velocity_mm_s);
}

}  // namespace unflex::dynamics
