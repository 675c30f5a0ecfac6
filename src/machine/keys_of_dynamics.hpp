// The keys of the section "dynamics" and those below it.
#pragma once

#include <array>
#include <string_view>

#include "key_access.hpp"

namespace unflex::machine::key_rows {

inline constexpr std::array<std::string_view, 2> kSwinging = {kOfAxes, kOfMasses};

inline constexpr std::array kDynamicsKeys = {
    Key{"dynamics.x.freq_hz", &axis_setting<&S::dynamics, 0, &D::freq_hz>,
        Bounds{.min = 1.0, .max = 1000.0}, "Hz", "Natural frequency of the nozzle along X"},
    Key{"dynamics.x.damping_ratio", &axis_setting<&S::dynamics, 0, &D::damping_ratio>,
        Bounds{.min = 0.0, .max = 1.0}, "", "Damping ratio ζ along X"},
    Key{"dynamics.x.moving_mass_g", &axis_setting<&S::dynamics, 0, &D::moving_mass_g>, kNotNegative,
        "g",
        "Mass of a bed that moves along X, without a print: frequencies are those of the empty bed "
        "and fall while the print grows; 0: the bed does not move along X"},
    Key{"dynamics.x.map", &axis_setting<&S::dynamics, 0, &D::map>, kAny, "",
        "Frequencies along X at some places of the nozzle: [[dynamics.x.map]] with along, \"x\", "
        "\"y\" or \"z\", and the lists at_mm and freq_hz; maps along several directions multiply "
        "as shares of freq_hz",
        "the same everywhere"},
    Key{"dynamics.x.mode", &axis_setting<&S::dynamics, 0, &D::modes>, kAny, "",
        "Modes along X, in place of freq_hz and damping_ratio: [[dynamics.x.mode]] with freq_hz, "
        "damping_ratio and gain; the gains add up to 1",
        "one mode"},
    Key{"dynamics.x.plant", &axis_setting<&S::dynamics, 0, &D::plants>, kAny, "",
        "Other models that X may have: [[dynamics.x.plant]] with share, its probability, and mode, "
        "a list as above; the base then suits them all",
        "none"},
    Key{"dynamics.x.mass_g",
        &mass_form<0, &M::mass_g>,
        kPositive,
        "g",
        "Mass that hangs on the X belt, instead of freq_hz",
        kOtherForm,
        nullptr,
        {},
        true},
    Key{"dynamics.x.stiffness_n_mm",
        &mass_form<0, &M::stiffness_n_mm>,
        kPositive,
        "N/mm",
        "Stiffness of the X belt, instead of freq_hz",
        kOtherForm,
        nullptr,
        {},
        true},
    Key{"dynamics.x.damping_n_s_mm",
        &mass_form<0, &M::damping_n_s_mm>,
        kNotNegative,
        "N·s/mm",
        "Damping of the X belt, instead of damping_ratio",
        kOtherForm,
        nullptr,
        {},
        true},
    Key{"dynamics.x.gantry_mass_g", &of_axis<0, &S::swing, &Q::gantry_mass_g>, kNotNegative, "g",
        "Masses: what moves with the tool along X alone"},
    Key{"dynamics.y.freq_hz", &axis_setting<&S::dynamics, 1, &D::freq_hz>,
        Bounds{.min = 1.0, .max = 1000.0}, "Hz", "Natural frequency of the nozzle along Y"},
    Key{"dynamics.y.damping_ratio", &axis_setting<&S::dynamics, 1, &D::damping_ratio>,
        Bounds{.min = 0.0, .max = 1.0}, "", "Damping ratio ζ along Y"},
    Key{"dynamics.y.moving_mass_g", &axis_setting<&S::dynamics, 1, &D::moving_mass_g>, kNotNegative,
        "g",
        "Mass of a bed that moves along Y, without a print: frequencies are those of the empty bed "
        "and fall while the print grows; 0: the bed does not move along Y"},
    Key{"dynamics.y.map", &axis_setting<&S::dynamics, 1, &D::map>, kAny, "",
        "Frequencies along Y at some places of the nozzle: [[dynamics.y.map]] with along, \"x\", "
        "\"y\" or \"z\", and the lists at_mm and freq_hz; maps along several directions multiply "
        "as shares of freq_hz",
        "the same everywhere"},
    Key{"dynamics.y.mode", &axis_setting<&S::dynamics, 1, &D::modes>, kAny, "",
        "Modes along Y, in place of freq_hz and damping_ratio: [[dynamics.y.mode]] with freq_hz, "
        "damping_ratio and gain; the gains add up to 1",
        "one mode"},
    Key{"dynamics.y.plant", &axis_setting<&S::dynamics, 1, &D::plants>, kAny, "",
        "Other models that Y may have: [[dynamics.y.plant]] with share, its probability, and mode, "
        "a list as above; the base then suits them all",
        "none"},
    Key{"dynamics.y.mass_g",
        &mass_form<1, &M::mass_g>,
        kPositive,
        "g",
        "Mass that hangs on the Y belt, instead of freq_hz",
        kOtherForm,
        nullptr,
        {},
        true},
    Key{"dynamics.y.stiffness_n_mm",
        &mass_form<1, &M::stiffness_n_mm>,
        kPositive,
        "N/mm",
        "Stiffness of the Y belt, instead of freq_hz",
        kOtherForm,
        nullptr,
        {},
        true},
    Key{"dynamics.y.damping_n_s_mm",
        &mass_form<1, &M::damping_n_s_mm>,
        kNotNegative,
        "N·s/mm",
        "Damping of the Y belt, instead of damping_ratio",
        kOtherForm,
        nullptr,
        {},
        true},
    Key{"dynamics.y.gantry_mass_g", &of_axis<1, &S::swing, &Q::gantry_mass_g>, kNotNegative, "g",
        "Masses: what moves with the tool along Y alone"},

    Key{"dynamics.a.carriage_mass_g", &drive_setting<0, &G::carriage_mass_g>, kNotNegative, "g",
        "Masses: what the first motor moves at its own drive"},
    Key{"dynamics.a.stiffness_n_mm", &drive_setting<0, &G::stiffness_n_mm>, kPositive, "N/mm",
        "Masses: stiffness of the first motor's drive", "rigid"},
    Key{"dynamics.a.damping_n_s_mm", &drive_setting<0, &G::damping_n_s_mm>, kNotNegative, "N·s/mm",
        "Masses: damping of the first motor's drive"},
    Key{"dynamics.b.carriage_mass_g", &drive_setting<1, &G::carriage_mass_g>, kNotNegative, "g",
        "Masses: what the second motor moves at its own drive"},
    Key{"dynamics.b.stiffness_n_mm", &drive_setting<1, &G::stiffness_n_mm>, kPositive, "N/mm",
        "Masses: stiffness of the second motor's drive", "rigid"},
    Key{"dynamics.b.damping_n_s_mm", &drive_setting<1, &G::damping_n_s_mm>, kNotNegative, "N·s/mm",
        "Masses: damping of the second motor's drive"},
    Key{"dynamics.c.carriage_mass_g", &drive_setting<2, &G::carriage_mass_g>, kNotNegative, "g",
        "Masses: what the third motor moves at its own drive"},
    Key{"dynamics.c.stiffness_n_mm", &drive_setting<2, &G::stiffness_n_mm>, kPositive, "N/mm",
        "Masses: stiffness of the third motor's drive", "rigid"},
    Key{"dynamics.c.damping_n_s_mm", &drive_setting<2, &G::damping_n_s_mm>, kNotNegative, "N·s/mm",
        "Masses: damping of the third motor's drive"},

    Key{"dynamics.of",
        &setting<&S::swing, &Q::of>,
        kAny,
        "",
        "What swings: each axis by itself, or masses on the drives of all motors, whose modes need "
        "not lie along the axes",
        {},
        nullptr,
        kSwinging},
    Key{"dynamics.tool_mass_g", &setting<&S::swing, &Q::tool_mass_g>, kPositive, "g",
        "Masses: what moves along all axes", kNotKnown},
    Key{"dynamics.freq_error", &setting<&S::dynamics_error, &R::freq>,
        Bounds{.min = 0.0, .max = 0.5}, "",
        "How far both frequencies may be off, either way, as a share; the base suits them all. 0: "
        "the frequencies are exact",
        "0.1", &derived<&S::freq_error>},
    Key{"dynamics.damping_error", &setting<&S::dynamics_error, &R::damping>,
        Bounds{.min = 0.0, .max = 0.9}, "",
        "How far both damping ratios may be off, either way, as a share"}};

}  // namespace unflex::machine::key_rows
