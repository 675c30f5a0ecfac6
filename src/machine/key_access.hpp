// The parts of the rows in the table of keys: access from a key to its member, and to the value in
// force while the member is unset.
#pragma once

#include <cstddef>
#include <limits>
#include <string_view>

#include "key_table.hpp"

namespace unflex::machine::key_rows {

inline constexpr Bounds kAny{};
inline constexpr Bounds kNotNegative{.min = 0.0};
inline constexpr Bounds kPositive{.min = 0.0, .min_open = true};

// Members of the settings' sections, and of the form of an axis as mass, spring and damper.
template <auto... Members>
auto& setting(Draft& draft) {
  return (draft.settings.*....*Members);
}

// Axis, Index: the number in Axes.
template <auto Member, std::size_t Axis, auto Field>
auto& axis_setting(Draft& draft) {
  return (draft.settings.*Member)[Axis].*Field;
}

template <std::size_t Axis, auto Field>
auto& mass_form(Draft& draft) {
  return draft.mass[Axis].*Field;
}

template <std::size_t Motor, auto Field>
auto& drive_setting(Draft& draft) {
  return draft.settings.swing.drives[Motor].*Field;
}

template <double (Settings::*Derived)() const>
double derived(const Settings& settings) {
  return (settings.*Derived)();
}

template <std::size_t Axis, auto... Members>
auto& of_axis(Draft& draft) {
  return setting<Members...>(draft)[Axis];
}

template <auto Derived, std::size_t Index>
double derived_of_axis(const Settings& settings) {
  return (settings.*Derived)()[Index];
}

// Infinity, which no key takes, stands for a value that is not known.
template <std::size_t Axis>
double known_shaper(const Settings& settings) {
  return settings.shaper_unknown()[Axis] ? std::numeric_limits<double>::infinity()
                                         : settings.shaper_freq_hz()[Axis];
}

using S = Settings;
using P = PrinterSettings;
using L = LimitSettings;
using E = ExtruderSettings;
using W = PressureSettings;
using H = HotendSettings;
using D = AxisDynamics;
using N = SecondSettings;
using Q = SwingSettings;
using K = KinematicsSettings;
using R = DynamicsError;
using G = DriveSettings;
using M = MassSpringDamper;
using B = BaseSettings;
using O = SolveSettings;
using T = EmitSettings;
using F = TimingSettings;
using V = VerifySettings;

inline constexpr std::string_view kNotLimited = "not limited";
inline constexpr std::string_view kOtherForm = "not used";
inline constexpr std::string_view kNotKnown = "not known";

}  // namespace unflex::machine::key_rows
