#include "key_table.hpp"

#include <array>

namespace unflex::machine {
namespace {

constexpr Bounds kAny{};
constexpr Bounds kNotNegative{.min = 0.0};
constexpr Bounds kPositive{.min = 0.0, .min_open = true};

// The member of a section of the settings, and of an axis' alternative dynamics.
template <auto Section, auto Field>
auto& setting(Draft& draft) {
  return draft.settings.*Section.*Field;
}

template <auto Axis, auto Field>
auto& mass_form(Draft& draft) {
  return draft.*Axis.*Field;
}

template <double (Settings::*Derived)() const>
double derived(const Settings& settings) {
  return (settings.*Derived)();
}

using S = Settings;
using P = PrinterSettings;
using L = LimitSettings;
using E = ExtruderSettings;
using D = AxisDynamics;
using M = MassSpringDamper;
using B = BaseSettings;
using O = SolveSettings;
using T = EmitSettings;
using V = VerifySettings;

constexpr std::string_view kNotLimited = "not limited";
constexpr std::string_view kOtherForm = "not used";

constexpr std::array kKeys = {
    Key{"printer.firmware", &setting<&S::printer, &P::firmware>, kAny, "",
        "Firmware that runs the output"},
    Key{"printer.travel_x_mm", &setting<&S::printer, &P::travel_x_mm>, kAny, "mm",
        "Where the base may be along X, [min, max]", kNotLimited},
    Key{"printer.travel_y_mm", &setting<&S::printer, &P::travel_y_mm>, kAny, "mm",
        "Where the base may be along Y, [min, max]", kNotLimited},
    Key{"printer.firmware_retraction", &setting<&S::printer, &P::firmware_retraction>, kAny, "",
        "The printer has [firmware_retraction], so G10 and G11 move filament"},
    Key{"printer.retract_length_mm", &setting<&S::printer, &P::retract_length_mm>, kNotNegative,
        "mm", "Filament G10 pulls back"},
    Key{"printer.retract_speed_mm_s", &setting<&S::printer, &P::retract_speed_mm_s>,
        Bounds{.min = 1.0}, "mm/s", "Speed of G10"},
    Key{"printer.unretract_extra_length_mm", &setting<&S::printer, &P::unretract_extra_length_mm>,
        kNotNegative, "mm", "Filament G11 pushes beyond what G10 pulled"},
    Key{"printer.unretract_speed_mm_s", &setting<&S::printer, &P::unretract_speed_mm_s>,
        Bounds{.min = 1.0}, "mm/s", "Speed of G11"},
    Key{"printer.arc_resolution_mm", &setting<&S::printer, &P::arc_resolution_mm>, kPositive, "mm",
        "[gcode_arcs] resolution: length of the chords the printer draws arcs with"},
    Key{"printer.input_shaper_freq_x_hz", &setting<&S::printer, &P::input_shaper_freq_x_hz>,
        kNotNegative, "Hz",
        "What the printer's own [input_shaper] is set back to after the print; 0 if it has none",
        "dynamics.x.freq_hz", &derived<&S::shaper_freq_x_hz>},
    Key{"printer.input_shaper_freq_y_hz", &setting<&S::printer, &P::input_shaper_freq_y_hz>,
        kNotNegative, "Hz",
        "What the printer's own [input_shaper] is set back to after the print; 0 if it has none",
        "dynamics.y.freq_hz", &derived<&S::shaper_freq_y_hz>},

    Key{"limits.max_velocity_mm_s", &setting<&S::limits, &L::max_velocity_mm_s>, kPositive, "mm/s",
        "[printer] max_velocity"},
    Key{"limits.max_accel_mm_s2", &setting<&S::limits, &L::max_accel_mm_s2>, kPositive, "mm/s²",
        "[printer] max_accel"},
    Key{"limits.square_corner_velocity_mm_s", &setting<&S::limits, &L::square_corner_velocity_mm_s>,
        kNotNegative, "mm/s", "[printer] square_corner_velocity"},
    Key{"limits.minimum_cruise_ratio", &setting<&S::limits, &L::minimum_cruise_ratio>,
        Bounds{.min = 0.0, .max = 1.0, .max_open = true}, "", "[printer] minimum_cruise_ratio"},
    Key{"limits.max_z_velocity_mm_s", &setting<&S::limits, &L::max_z_velocity_mm_s>, kPositive,
        "mm/s", "[printer] max_z_velocity", "limits.max_velocity_mm_s",
        &derived<&S::max_z_velocity_mm_s>},
    Key{"limits.max_z_accel_mm_s2", &setting<&S::limits, &L::max_z_accel_mm_s2>, kPositive, "mm/s²",
        "[printer] max_z_accel", "limits.max_accel_mm_s2", &derived<&S::max_z_accel_mm_s2>},

    Key{"extruder.nozzle_diameter_mm", &setting<&S::extruder, &E::nozzle_diameter_mm>, kPositive,
        "mm", "[extruder] nozzle_diameter"},
    Key{"extruder.filament_diameter_mm", &setting<&S::extruder, &E::filament_diameter_mm>,
        kPositive, "mm", "[extruder] filament_diameter"},
    Key{"extruder.max_extrude_cross_section_mm2",
        &setting<&S::extruder, &E::max_extrude_cross_section_mm2>, kPositive, "mm²",
        "[extruder] max_extrude_cross_section", "4 × nozzle_diameter_mm²",
        &derived<&S::max_extrude_cross_section_mm2>},
    Key{"extruder.max_extrude_only_velocity_mm_s",
        &setting<&S::extruder, &E::max_extrude_only_velocity_mm_s>, kPositive, "mm/s",
        "[extruder] max_extrude_only_velocity",
        "limits.max_velocity_mm_s × 4 × nozzle_diameter_mm² / filament area",
        &derived<&S::max_extrude_only_velocity_mm_s>},
    Key{"extruder.max_extrude_only_accel_mm_s2",
        &setting<&S::extruder, &E::max_extrude_only_accel_mm_s2>, kPositive, "mm/s²",
        "[extruder] max_extrude_only_accel",
        "limits.max_accel_mm_s2 × 4 × nozzle_diameter_mm² / filament area",
        &derived<&S::max_extrude_only_accel_mm_s2>},
    Key{"extruder.instantaneous_corner_velocity_mm_s",
        &setting<&S::extruder, &E::instantaneous_corner_velocity_mm_s>, kNotNegative, "mm/s",
        "[extruder] instantaneous_corner_velocity"},

    Key{"dynamics.x.freq_hz", &setting<&S::dynamics_x, &D::freq_hz>,
        Bounds{.min = 1.0, .max = 1000.0}, "Hz", "Natural frequency of the nozzle along X"},
    Key{"dynamics.x.damping_ratio", &setting<&S::dynamics_x, &D::damping_ratio>,
        Bounds{.min = 0.0, .max = 1.0}, "", "Damping ratio ζ along X"},
    Key{"dynamics.x.mass_g", &mass_form<&Draft::mass_x, &M::mass_g>, kPositive, "g",
        "Mass that hangs on the X belt, instead of freq_hz", kOtherForm, nullptr, true},
    Key{"dynamics.x.stiffness_n_mm", &mass_form<&Draft::mass_x, &M::stiffness_n_mm>, kPositive,
        "N/mm", "Stiffness of the X belt, instead of freq_hz", kOtherForm, nullptr, true},
    Key{"dynamics.x.damping_n_s_mm", &mass_form<&Draft::mass_x, &M::damping_n_s_mm>, kNotNegative,
        "N·s/mm", "Damping of the X belt, instead of damping_ratio", kOtherForm, nullptr, true},
    Key{"dynamics.y.freq_hz", &setting<&S::dynamics_y, &D::freq_hz>,
        Bounds{.min = 1.0, .max = 1000.0}, "Hz", "Natural frequency of the nozzle along Y"},
    Key{"dynamics.y.damping_ratio", &setting<&S::dynamics_y, &D::damping_ratio>,
        Bounds{.min = 0.0, .max = 1.0}, "", "Damping ratio ζ along Y"},
    Key{"dynamics.y.mass_g", &mass_form<&Draft::mass_y, &M::mass_g>, kPositive, "g",
        "Mass that hangs on the Y belt, instead of freq_hz", kOtherForm, nullptr, true},
    Key{"dynamics.y.stiffness_n_mm", &mass_form<&Draft::mass_y, &M::stiffness_n_mm>, kPositive,
        "N/mm", "Stiffness of the Y belt, instead of freq_hz", kOtherForm, nullptr, true},
    Key{"dynamics.y.damping_n_s_mm", &mass_form<&Draft::mass_y, &M::damping_n_s_mm>, kNotNegative,
        "N·s/mm", "Damping of the Y belt, instead of damping_ratio", kOtherForm, nullptr, true},

    Key{"base.max_velocity_mm_s", &setting<&S::base, &B::max_velocity_mm_s>, kPositive, "mm/s",
        "Speed the motor of an axis can do", "2 × limits.max_velocity_mm_s",
        &derived<&S::base_max_velocity_mm_s>},
    Key{"base.max_accel_mm_s2", &setting<&S::base, &B::max_accel_mm_s2>, kPositive, "mm/s²",
        "Acceleration the motor of an axis can do", "4 × limits.max_accel_mm_s2",
        &derived<&S::base_max_accel_mm_s2>},
    Key{"base.max_jerk_mm_s3", &setting<&S::base, &B::max_jerk_mm_s3>, kNotNegative, "mm/s³",
        "Jerk the motor of an axis can do; 0 does not limit it"},

    Key{"solve.window_s", &setting<&S::solve, &O::window_s>, Bounds{.min = 0.05, .max = 60.0}, "s",
        "Part of a long run that is solved at once"},
    Key{"solve.overlap_s", &setting<&S::solve, &O::overlap_s>, Bounds{.min = 0.0, .max = 10.0}, "s",
        "What such a part sees of its neighbours on either side"},
    Key{"solve.lead_in_ms", &setting<&S::solve, &O::lead_in_ms>, Bounds{.min = 0.0, .max = 1000.0},
        "ms", "How long before the plan the base may start"},
    Key{"solve.tail_ms", &setting<&S::solve, &O::tail_ms>, Bounds{.min = 0.0, .max = 1000.0}, "ms",
        "How long after the plan the base may settle", "8ζ/ω of the slower axis, at least 2",
        [](const Settings& settings) { return settings.tail_s() * 1e3; }},
    Key{"solve.travel_weight", &setting<&S::solve, &O::travel_weight>,
        Bounds{.min = 0.0, .max = 1.0, .min_open = true}, "",
        "Weight of the tracking error where nothing is extruded, 1 where something is"},
    Key{"solve.jerk_weight", &setting<&S::solve, &O::jerk_weight>,
        Bounds{.min = 0.0, .max = 1e6, .min_open = true}, "",
        "Weight of the base's jerk against the tracking error"},

    Key{"emit.period_ms", &setting<&S::emit, &T::period_ms>, Bounds{.min = 0.05, .max = 50.0}, "ms",
        "Node period: time between two points of the base's motion"},
    Key{"emit.tolerance_um", &setting<&S::emit, &T::tolerance_um>,
        Bounds{.min = 0.0, .max = 1000.0}, "µm",
        "How far what a line leaves out of the base's motion may move the nozzle",
        "0.3 at 45 Hz, in proportion to the lower frequency", &derived<&S::tolerance_um>},
    Key{"emit.max_lines_per_s", &setting<&S::emit, &T::max_lines_per_s>, Bounds{.min = 1.0}, "1/s",
        "Lines the printer can take in a second of print; never exceeded"},
    Key{"emit.max_speed_step_mm_s", &setting<&S::emit, &T::max_speed_step_mm_s>, kPositive, "mm/s",
        "How much an axis' speed may change from line to line, where lines can be short enough"},
    Key{"emit.accel_mm_s2", &setting<&S::emit, &T::accel_mm_s2>, kPositive, "mm/s²",
        "The printer's max_accel while it runs compensated motion"},
    Key{"emit.square_corner_velocity_mm_s", &setting<&S::emit, &T::square_corner_velocity_mm_s>,
        kPositive, "mm/s", "The printer's square_corner_velocity while it runs compensated motion"},

    Key{"verify.step_ms", &setting<&S::verify, &V::step_ms>, Bounds{.min = 0.001, .max = 0.1}, "ms",
        "Step of the integration of the nozzle's motion"},
    Key{"verify.hold_s", &setting<&S::verify, &V::hold_s>, Bounds{.min = 0.0, .max = 10.0}, "s",
        "How long the nozzle is watched after the last move"},
};

}  // namespace

bool Bounds::contains(double value) const {
  return (min_open ? value > min : value >= min) && (max_open ? value < max : value <= max);
}

std::span<const Key> key_table() { return kKeys; }

std::optional<std::size_t> find_key(std::string_view name) {
  for (std::size_t i = 0; i < kKeys.size(); ++i) {
    if (kKeys[i].name == name) {
      return i;
    }
  }
  return std::nullopt;
}

bool is_section(std::string_view name) {
  for (const Key& key : kKeys) {
    if (key.name.size() > name.size() && key.name.starts_with(name) &&
        key.name[name.size()] == '.') {
      return true;
    }
  }
  return false;
}

}  // namespace unflex::machine
