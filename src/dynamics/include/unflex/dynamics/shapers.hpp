// Input shapers, the rivals in every firmware: the reference is convolved with a train of pulses
// that leaves no vibration, or little of it, behind.
//
//   f     natural frequency, undamped, Hz      ζ     damping ratio
//   K     e^{−πζ/√(1−ζ²)}: what a half period of damping leaves      T_d   1/(f √(1−ζ²))
//
// Pulses as in Klipper, klippy/extras/shaper_defs.py. The shapers come from:
//   ZV, ZVD     Singer & Seering, "Preshaping command inputs to reduce system vibration",
//               J. Dyn. Syst. Meas. Control 112 (1990) 76–82
//   EI          Singhose, Seering & Singer, "Residual vibration reduction using vector diagrams to
//               generate shaped inputs", J. Mech. Des. 116 (1994) 654–659, here at 5 % vibration
//   2HUMP_EI, 3HUMP_EI    Singhose, Porter, Tuttle & Singer, "Vibration reduction using multi-hump
//               input shapers", J. Dyn. Syst. Meas. Control 119 (1997) 320–326
//   MZV         Klipper's own, with two parameters since March 2026; see MzvForm
//   ZVDD, ZVDDD ZVD with one and two pulses more (binomial weights), as in
//               RepRapFirmware, Movement/AxisShaper.cpp
#pragma once

#include <array>
#include <optional>
#include <string_view>
#include <vector>

namespace unflex::dynamics {

enum class ShaperKind { zv, mzv, zvd, ei, two_hump_ei, three_hump_ei, zvdd, zvddd };

// The kinds that Klipper has. zvdd and zvddd are RepRapFirmware's alone.
inline constexpr std::array<ShaperKind, 6> kShaperKinds = {
    ShaperKind::zv, ShaperKind::mzv,         ShaperKind::zvd,
    ShaperKind::ei, ShaperKind::two_hump_ei, ShaperKind::three_hump_ei};

// As Klipper spells it in capitals: "ZV", "2HUMP_EI".
[[nodiscard]] std::string_view name(ShaperKind kind);

// Above this damping ratio the pulses are not defined: 0.99 for pulses in closed form, 0.4, 0.3 and
// 0.2 for EI, 2HUMP_EI and 3HUMP_EI, which are fits. Klipper refuses them there.
[[nodiscard]] double max_damping_ratio(ShaperKind kind);

// The parameters of MZV in Klipper: the number of pulses, 3 to 10, and the time over which they are
// evenly spaced. The time is at least half a damped period. At this bound MZV is ZV. The time is
// less than (pulses − 1)/2 damped periods. At that bound MZV becomes ZV convolved with itself
// pulses − 2 times.
struct MzvForm {
  int pulses = 3;
  double duration_periods = 0.75;  // from the first pulse to the last, in damped periods

  [[nodiscard]] bool is_defined() const;
  [[nodiscard]] bool operator==(const MzvForm&) const = default;
};

// The form that Klipper reads from "mzv", "mzv(n=4,t=0.9)", "mzv(4,0.9)" or "mzv(n=4,tau=1.2)".
// nullopt for any other text, and for forms that are not defined. tau is the duration that t tends
// to if n grows and the zeros stay: t = tau (n − 1)/(n + 2 tau − 2).
[[nodiscard]] std::optional<MzvForm> mzv_form(std::string_view text);

// A shaper: its kind, and if that is MZV, its form.
struct Shaper {
  ShaperKind kind = ShaperKind::mzv;
  MzvForm form = {};

  // These conversions are implicit, since a kind or a form alone describes a shaper.
  constexpr Shaper(ShaperKind of_kind) : kind(of_kind) {}  // NOLINT(google-explicit-constructor)
  constexpr Shaper(MzvForm of_mzv) : form(of_mzv) {}       // NOLINT(google-explicit-constructor)
};

// The reference, delayed by time_s, counts with this weight.
struct Pulse {
  double time_s = 0.0;
  double weight = 0.0;
};

// In order of time; the weights sum up to 1 and the mean delay Σ weight · time_s is 0, so that
// motion at constant speed stays what it is (as in Klipper, klippy/chelper/kin_shaper.c). The first
// pulses therefore lie before 0.
using ShaperPulses = std::vector<Pulse>;

// The pulses for an axis with this frequency and damping. nullopt above max_damping_ratio() and for
// a form that is not defined; freq_hz must be above zero.
[[nodiscard]] std::optional<ShaperPulses> shaper_pulses(const Shaper& shaper, double freq_hz,
                                                        double damping_ratio);

}  // namespace unflex::dynamics
