#include "key_table.hpp"

#include <algorithm>
#include <array>

#include "keys_of_dynamics.hpp"
#include "keys_of_printer.hpp"

namespace unflex::machine {
namespace {

using namespace key_rows;

constexpr std::array<std::string_view, 4> kPressureShapes = {kLinearPressure, "two_slopes", "tanh",
                                                             "reciprocal"};
constexpr std::array<std::string_view, 2> kTimingMethods = {kScaled, kOptimal};
constexpr std::array<std::string_view, 2> kAheadWhen = {"heating", "both"};
constexpr std::array<std::string_view, 5> kSecondShapers = {"zv", "mzv", "zvd", "ei", "none"};

constexpr std::array kEarlierKeys = {
    Key{"limits.max_velocity_mm_s", &setting<&S::limits, &L::max_velocity_mm_s>, kPositive, "mm/s",
        "Klipper: [printer] max_velocity; the others: the larger of X and Y"},
    Key{"limits.max_accel_mm_s2", &setting<&S::limits, &L::max_accel_mm_s2>, kPositive, "mm/s²",
        "Klipper: [printer] max_accel; the others: the larger of X and Y"},
    Key{"limits.square_corner_velocity_mm_s", &setting<&S::limits, &L::square_corner_velocity_mm_s>,
        kNotNegative, "mm/s", "Klipper: [printer] square_corner_velocity"},
    Key{"limits.minimum_cruise_ratio", &setting<&S::limits, &L::minimum_cruise_ratio>,
        Bounds{.min = 0.0, .max = 1.0, .max_open = true}, "",
        "Klipper: [printer] minimum_cruise_ratio"},
    Key{"limits.max_x_velocity_mm_s", &of_axis<0, &S::limits, &L::axis_max_velocity_mm_s>,
        kPositive, "mm/s", "Marlin, RRF: M203 X", "limits.max_velocity_mm_s",
        &derived_of_axis<&S::axis_max_velocity_mm_s, 0>},
    Key{"limits.max_y_velocity_mm_s", &of_axis<1, &S::limits, &L::axis_max_velocity_mm_s>,
        kPositive, "mm/s", "Marlin, RRF: M203 Y", "limits.max_velocity_mm_s",
        &derived_of_axis<&S::axis_max_velocity_mm_s, 1>},
    Key{"limits.max_z_velocity_mm_s", &of_axis<2, &S::limits, &L::axis_max_velocity_mm_s>,
        kPositive, "mm/s", "Klipper: [printer] max_z_velocity; Marlin, RRF: M203 Z",
        "Klipper limits.max_velocity_mm_s, Marlin 5, RRF 20",
        &derived_of_axis<&S::axis_max_velocity_mm_s, 2>},
    Key{"limits.max_e_velocity_mm_s", &of_axis<3, &S::limits, &L::axis_max_velocity_mm_s>,
        kPositive, "mm/s", "Marlin, RRF: M203 E", "Marlin 25, RRF 100",
        &derived_of_axis<&S::axis_max_velocity_mm_s, 3>},
    Key{"limits.max_x_accel_mm_s2", &of_axis<0, &S::limits, &L::axis_max_accel_mm_s2>, kPositive,
        "mm/s²", "Marlin, RRF: M201 X", "limits.max_accel_mm_s2",
        &derived_of_axis<&S::axis_max_accel_mm_s2, 0>},
    Key{"limits.max_y_accel_mm_s2", &of_axis<1, &S::limits, &L::axis_max_accel_mm_s2>, kPositive,
        "mm/s²", "Marlin, RRF: M201 Y", "limits.max_accel_mm_s2",
        &derived_of_axis<&S::axis_max_accel_mm_s2, 1>},
    Key{"limits.max_z_accel_mm_s2", &of_axis<2, &S::limits, &L::axis_max_accel_mm_s2>, kPositive,
        "mm/s²", "Klipper: [printer] max_z_accel; Marlin, RRF: M201 Z",
        "Klipper limits.max_accel_mm_s2, Marlin 100, RRF 200",
        &derived_of_axis<&S::axis_max_accel_mm_s2, 2>},
    Key{"limits.max_e_accel_mm_s2", &of_axis<3, &S::limits, &L::axis_max_accel_mm_s2>, kPositive,
        "mm/s²", "Marlin, RRF: M201 E", "Marlin 10000, RRF 500",
        &derived_of_axis<&S::axis_max_accel_mm_s2, 3>},
    Key{"limits.print_accel_mm_s2", &setting<&S::limits, &L::print_accel_mm_s2>, kPositive, "mm/s²",
        "Marlin, RRF: M204 P", "Marlin limits.max_accel_mm_s2, RRF 50000",
        &derived<&S::print_accel_mm_s2>},
    Key{"limits.travel_accel_mm_s2", &setting<&S::limits, &L::travel_accel_mm_s2>, kPositive,
        "mm/s²", "Marlin, RRF: M204 T", "Marlin limits.max_accel_mm_s2, RRF 50000",
        &derived<&S::travel_accel_mm_s2>},
    Key{"limits.retract_accel_mm_s2", &setting<&S::limits, &L::retract_accel_mm_s2>, kPositive,
        "mm/s²", "Marlin: M204 R", "limits.max_accel_mm_s2", &derived<&S::retract_accel_mm_s2>},
    Key{"limits.junction_deviation_mm", &setting<&S::limits, &L::junction_deviation_mm>,
        Bounds{.min = 0.01, .max = 0.3}, "mm", "Marlin: M205 J, without printer.classic_jerk"},
    Key{"limits.jerk_x_mm_s", &of_axis<0, &S::limits, &L::jerk_mm_s>, kNotNegative, "mm/s",
        "Marlin with printer.classic_jerk: M205 X; RRF: M566 X", "Marlin 10, RRF 15",
        &derived_of_axis<&S::jerk_mm_s, 0>},
    Key{"limits.jerk_y_mm_s", &of_axis<1, &S::limits, &L::jerk_mm_s>, kNotNegative, "mm/s",
        "Marlin with printer.classic_jerk: M205 Y; RRF: M566 Y", "Marlin 10, RRF 15",
        &derived_of_axis<&S::jerk_mm_s, 1>},
    Key{"limits.jerk_z_mm_s", &of_axis<2, &S::limits, &L::jerk_mm_s>, kNotNegative, "mm/s",
        "Marlin with printer.classic_jerk: M205 Z; RRF: M566 Z", "Marlin 0.3, RRF 10",
        &derived_of_axis<&S::jerk_mm_s, 2>},
    Key{"limits.jerk_e_mm_s", &of_axis<3, &S::limits, &L::jerk_mm_s>, kNotNegative, "mm/s",
        "Marlin with printer.classic_jerk: M205 E; RRF: M566 E", "5",
        &derived_of_axis<&S::jerk_mm_s, 3>},
    Key{"limits.print_jerk_x_mm_s", &of_axis<0, &S::limits, &L::print_jerk_mm_s>, kNotNegative,
        "mm/s", "RRF: M205 X", "limits.jerk_x_mm_s", &derived_of_axis<&S::print_jerk_mm_s, 0>},
    Key{"limits.print_jerk_y_mm_s", &of_axis<1, &S::limits, &L::print_jerk_mm_s>, kNotNegative,
        "mm/s", "RRF: M205 Y", "limits.jerk_y_mm_s", &derived_of_axis<&S::print_jerk_mm_s, 1>},
    Key{"limits.print_jerk_z_mm_s", &of_axis<2, &S::limits, &L::print_jerk_mm_s>, kNotNegative,
        "mm/s", "RRF: M205 Z", "limits.jerk_z_mm_s", &derived_of_axis<&S::print_jerk_mm_s, 2>},
    Key{"limits.print_jerk_e_mm_s", &of_axis<3, &S::limits, &L::print_jerk_mm_s>, kNotNegative,
        "mm/s", "RRF: M205 E", "limits.jerk_e_mm_s", &derived_of_axis<&S::print_jerk_mm_s, 3>},
    Key{"limits.jerk_policy", &setting<&S::limits, &L::jerk_policy>, Bounds{.min = 0.0, .max = 1.0},
        "", "RRF: M566 P"},
    Key{"limits.min_velocity_mm_s", &setting<&S::limits, &L::min_velocity_mm_s>, kNotNegative,
        "mm/s", "Marlin: M205 S"},
    Key{"limits.min_travel_velocity_mm_s", &setting<&S::limits, &L::min_travel_velocity_mm_s>,
        kNotNegative, "mm/s", "Marlin: M205 T"},
    Key{"limits.min_segment_time_ms", &setting<&S::limits, &L::min_segment_time_ms>, kNotNegative,
        "ms", "Marlin: M205 B; 0 where SLOWDOWN is off"},
    Key{"limits.min_movement_velocity_mm_s", &setting<&S::limits, &L::min_movement_velocity_mm_s>,
        kPositive, "mm/s", "RRF: M203 I"},

    Key{"extruder.nozzle_diameter_mm", &setting<&S::extruder, &E::nozzle_diameter_mm>, kPositive,
        "mm", "Klipper: [extruder] nozzle_diameter"},
    Key{"extruder.filament_diameter_mm", &setting<&S::extruder, &E::filament_diameter_mm>,
        kPositive, "mm", "Klipper: [extruder] filament_diameter; Marlin, RRF: of M200 without D"},
    Key{"extruder.filament_area_mm2", &setting<&S::extruder, &E::filament_area_mm2>,
        Bounds{.min = 0.1, .max = 20.0}, "mm²",
        "Section of the filament that is material, where it is not a full cylinder; E is fitted to "
        "it",
        "a full section of filament_diameter_mm", &derived<&S::filament_area_mm2>},
    Key{"extruder.filament_density_g_cm3", &setting<&S::extruder, &E::filament_density_g_cm3>,
        Bounds{.min = 0.1, .max = 20.0}, "g/cm³",
        "Density of the filament, for the mass of the print on a bed that moves"},
    Key{"extruder.filament_profile", &setting<&S::extruder, &E::filament_profile>, kAny, "",
        "Table of that section along the spool: columns mm and area_mm2 or diameter_mm"},
    Key{"extruder.filament_start_mm", &setting<&S::extruder, &E::filament_start_mm>, kAny, "mm",
        "Where on the profile the print begins"},
    Key{"extruder.max_extrude_cross_section_mm2",
        &setting<&S::extruder, &E::max_extrude_cross_section_mm2>, kPositive, "mm²",
        "Klipper: [extruder] max_extrude_cross_section", "4 × nozzle_diameter_mm²",
        &derived<&S::max_extrude_cross_section_mm2>},
    Key{"extruder.max_extrude_only_velocity_mm_s",
        &setting<&S::extruder, &E::max_extrude_only_velocity_mm_s>, kPositive, "mm/s",
        "Klipper: [extruder] max_extrude_only_velocity",
        "limits.max_velocity_mm_s × 4 × nozzle_diameter_mm² / filament area",
        &derived<&S::max_extrude_only_velocity_mm_s>},
    Key{"extruder.max_extrude_only_accel_mm_s2",
        &setting<&S::extruder, &E::max_extrude_only_accel_mm_s2>, kPositive, "mm/s²",
        "Klipper: [extruder] max_extrude_only_accel",
        "limits.max_accel_mm_s2 × 4 × nozzle_diameter_mm² / filament area",
        &derived<&S::max_extrude_only_accel_mm_s2>},
    Key{"extruder.max_flow_mm3_s", &setting<&S::extruder, &E::max_flow_mm3_s>, kPositive, "mm³/s",
        "Largest volume of filament that the hotend melts per second; a free timing keeps it, and "
        "a "
        "warning tells where the output asks for more, and more than the sliced file",
        "not limited"},
    Key{"extruder.instantaneous_corner_velocity_mm_s",
        &setting<&S::extruder, &E::instantaneous_corner_velocity_mm_s>, kNotNegative, "mm/s",
        "Klipper: [extruder] instantaneous_corner_velocity"},
    Key{"extruder.pressure_advance_s", &setting<&S::extruder, &E::pressure_advance_s>, kNotNegative,
        "s",
        "Klipper: [extruder] pressure_advance, RRF: M572 S; where it is on, Klipper's shaper "
        "switches later"},
    Key{"extruder.pressure_advance_smooth_s", &setting<&S::extruder, &E::pressure_advance_smooth_s>,
        Bounds{.min = 0.0, .max = 0.2, .min_open = true}, "s",
        "Klipper: [extruder] pressure_advance_smooth_time"},

    Key{"pressure.written", &setting<&S::pressure, &W::written>, kAny, "",
        "Whether compensated runs press filament together as the hotend needs it: Klipper's own "
        "pressure advance with a shorter smooth time if the shape is linear; else the printer's "
        "own is off and the advance is written into the filament. Only where the printer's, the "
        "print's or pressure.advance_s tells it",
        "true for Klipper with a linear shape, else false"},
    Key{"pressure.advance_s", &setting<&S::pressure, &W::advance_s>, kNotNegative, "s",
        "Pressure advance that the hotend needs, whatever the printer's own is set to; 0: not "
        "known",
        "the printer's own, or the print's"},
    Key{"pressure.shape",
        &setting<&S::pressure, &W::shape>,
        kAny,
        "",
        "How much filament is pressed together at a flow q: K q with the advance K (linear); "
        "beyond the knee with a second slope (two_slopes); "
        "plus offset·tanh(q/knee) (tanh) or offset·(1 − 1/(1 + q/knee)) (reciprocal)",
        {},
        nullptr,
        kPressureShapes},
    Key{"pressure.offset_mm", &setting<&S::pressure, &W::offset_mm>, kNotNegative, "mm",
        "Filament, for tanh and reciprocal"},
    Key{"pressure.knee_mm_s", &setting<&S::pressure, &W::knee_mm_s>, kPositive, "mm/s",
        "Flow of filament, for two_slopes, tanh and reciprocal"},
    Key{"pressure.second_advance_s", &setting<&S::pressure, &W::second_advance_s>, kNotNegative,
        "s", "Slope beyond the knee, for two_slopes"},
    Key{"pressure.dead_time_ms", &setting<&S::pressure, &W::dead_time_ms>,
        Bounds{.min = 0.0, .max = 50.0}, "ms", "Time until the flow answers the extruder at all"},
    Key{"pressure.max_extruder_accel_mm_s2", &setting<&S::pressure, &W::max_extruder_accel_mm_s2>,
        kPositive, "mm/s²", "Acceleration of filament that the extruder follows"},
    Key{"pressure.line_width_mm", &setting<&S::pressure, &W::line_width_mm>, kPositive, "mm",
        "Width of a line, to tell errors of its width in µm"},

    Key{"hotend.gain_c", &setting<&S::hotend, &H::gain_c>, kPositive, "°C",
        "Rise of temperature for each count of power, of which 255 are full power", kNotKnown},
    Key{"hotend.time_constant_s", &setting<&S::hotend, &H::time_constant_s>, kPositive, "s",
        "Time in which the block comes within 37 % of a new temperature", kNotKnown},
    Key{"hotend.sensor_lag_s", &setting<&S::hotend, &H::sensor_lag_s>, kNotNegative, "s",
        "Time by which the sensor lags behind the block"},
    Key{"hotend.dead_time_s", &setting<&S::hotend, &H::dead_time_s>, kPositive, "s",
        "Time in which a change of power does not show at all", kNotKnown},
    Key{"hotend.ambient_c", &setting<&S::hotend, &H::ambient_c>, Bounds{.min = -50.0, .max = 150.0},
        "°C", "Temperature of the hotend without power"},
    Key{"hotend.heater_w", &setting<&S::hotend, &H::heater_w>, kPositive, "W",
        "What the heater gives at full power, for the load of melting filament", kNotKnown},
    Key{"hotend.band_c", &setting<&S::hotend, &H::band_c>, kPositive, "°C",
        "How far the temperature may be from its target while filament is laid"},
    Key{"hotend.ahead", &setting<&S::hotend, &H::ahead>, kAny, "",
        "Whether changes of temperature within the print are asked for so early that the hotend "
        "has followed when they are due"},
    Key{"hotend.ahead_when",
        &setting<&S::hotend, &H::ahead_when>,
        kAny,
        "",
        "Which of them: those to a higher temperature, or both",
        {},
        nullptr,
        kAheadWhen}};

constexpr std::array kLaterKeys = {
    Key{"second.x_freq_hz", &of_axis<0, &S::second, &N::freq_hz>, Bounds{.min = 0.0, .max = 1000.0},
        "Hz",
        "What X still rings at once it is compensated; the base is shaped against it. 0: none"},
    Key{"second.x_damping_ratio", &of_axis<0, &S::second, &N::damping_ratio>,
        Bounds{.min = 0.0, .max = 0.5}, "", "Damping ratio of that mode"},
    Key{"second.y_freq_hz", &of_axis<1, &S::second, &N::freq_hz>, Bounds{.min = 0.0, .max = 1000.0},
        "Hz", "What Y still rings at, likewise"},
    Key{"second.y_damping_ratio", &of_axis<1, &S::second, &N::damping_ratio>,
        Bounds{.min = 0.0, .max = 0.5}, "", "Damping ratio of that mode"},
    Key{"second.shaper",
        &setting<&S::second, &N::shaper>,
        kAny,
        "",
        "Shaper of the base for these modes; none: they are verified and reported, not shaped",
        {},
        nullptr,
        kSecondShapers},

    Key{"kinematics.type", &setting<&S::kinematics, &K::type>, kAny, "",
        "Which motors move which axes. base.* limits are those of motors"},
    Key{"kinematics.joint_a", &of_axis<0, &S::kinematics, &K::joints>, kAny, "",
        "Linear machines: travel of the first motor per mm of X, of Y and of Z",
        "tripteron [1, 1, -1]"},
    Key{"kinematics.joint_b", &of_axis<1, &S::kinematics, &K::joints>, kAny, "",
        "Linear machines: travel of the second motor", "tripteron [1, -1, -1]"},
    Key{"kinematics.joint_c", &of_axis<2, &S::kinematics, &K::joints>, kAny, "",
        "Linear machines: travel of the third motor", "tripteron [1, 0, 1]"},
    Key{"kinematics.offset_mm", &setting<&S::kinematics, &K::offset_mm>, kAny, "mm",
        "Where the joints of the three motors are when the tool is at 0, 0, 0",
        "as the legs of a tripteron tell, else [0, 0, 0]"},
    Key{"kinematics.home_mm", &setting<&S::kinematics, &K::home_mm>, kAny, "mm",
        "Where the tool is after G28, [x, y, z]; unflex translate begins there", kNotKnown},
    Key{"kinematics.range_a_mm", &of_axis<0, &S::kinematics, &K::range_mm>, kAny, "mm",
        "Where the joint of the first motor may be, [min, max]; unflex kinematics holds prints to "
        "it",
        kNotLimited},
    Key{"kinematics.range_b_mm", &of_axis<1, &S::kinematics, &K::range_mm>, kAny, "mm",
        "Where the joint of the second motor may be, [min, max]; unflex kinematics holds prints to "
        "it",
        kNotLimited},
    Key{"kinematics.range_c_mm", &of_axis<2, &S::kinematics, &K::range_mm>, kAny, "mm",
        "Where the joint of the third motor may be, [min, max]; unflex kinematics holds prints to "
        "it",
        kNotLimited},
    Key{"kinematics.bars_mm", &setting<&S::kinematics, &K::bars_mm>, kAny, "mm",
        "Tripteron: lengths of each leg's bars, [upper, lower]; with the keys below, the legs' "
        "reach",
        kNotKnown},
    Key{"kinematics.rail_y_mm", &setting<&S::kinematics, &K::rail_y_mm>, kAny, "mm",
        "Tripteron: Y of the joints on the sliders of the three rails", kNotKnown},
    Key{"kinematics.rail_z_mm", &setting<&S::kinematics, &K::rail_z_mm>, kAny, "mm",
        "Tripteron: Z of the joints on the sliders of the three rails", kNotKnown},
    Key{"kinematics.tool_joint_a_mm", &of_axis<0, &S::kinematics, &K::tool_joint_mm>, kAny, "mm",
        "Tripteron: from the nozzle to the tool's joint of the first leg, [x, y, z]", kNotKnown},
    Key{"kinematics.tool_joint_b_mm", &of_axis<1, &S::kinematics, &K::tool_joint_mm>, kAny, "mm",
        "Tripteron: from the nozzle to the tool's joint of the second leg, [x, y, z]", kNotKnown},
    Key{"kinematics.tool_joint_c_mm", &of_axis<2, &S::kinematics, &K::tool_joint_mm>, kAny, "mm",
        "Tripteron: from the nozzle to the tool's joint of the third leg, [x, y, z]", kNotKnown},
    Key{"kinematics.elbow_deg", &setting<&S::kinematics, &K::elbow_deg>, kAny, "°",
        "Tripteron: angles that the legs' elbows may have, [min, max]; 0 is a straight leg",
        "0 to 180"},

    Key{"base.max_velocity_mm_s", &setting<&S::base, &B::max_velocity_mm_s>, kPositive, "mm/s",
        "Speed a motor can do", "2 × limits.max_velocity_mm_s, or less by printer.max_step_rate_hz",
        &derived<&S::base_max_velocity_mm_s>},
    Key{"base.max_accel_mm_s2", &setting<&S::base, &B::max_accel_mm_s2>, kPositive, "mm/s²",
        "Acceleration a motor can do",
        "2 × the larger of limits.max_accel_mm_s2 and what a run's plan accelerates; 2√2 × for a "
        "Klipper on which a motor moves X and Y",
        &derived<&S::base_max_accel_mm_s2>},
    Key{"base.max_jerk_mm_s3", &setting<&S::base, &B::max_jerk_mm_s3>, kNotNegative, "mm/s³",
        "Jerk a motor can do; 0 does not limit it"},

    Key{"solve.window_s", &setting<&S::solve, &O::window_s>, Bounds{.min = 0.05, .max = 60.0}, "s",
        "Part of a long run that is solved at once"},
    Key{"solve.overlap_s", &setting<&S::solve, &O::overlap_s>, Bounds{.min = 0.0, .max = 10.0}, "s",
        "How much of its neighbours on either side such a part takes into account, at least; axes "
        "of several modes and a base that suits several models need more"},
    Key{"solve.lead_in_ms", &setting<&S::solve, &O::lead_in_ms>, Bounds{.min = 0.0, .max = 1000.0},
        "ms",
        "How long before the plan the base may start at least. Where a run begins to lay filament, "
        "the time that the base needs to get ahead of the nozzle"},
    Key{"solve.tail_ms", &setting<&S::solve, &O::tail_ms>, Bounds{.min = 0.0, .max = 1000.0}, "ms",
        "How long after the plan the base may settle",
        "8ζ/ω of the slower axis, at least 2; Marlin, RRF 1 / emit.max_lines_per_s",
        [](const Settings& settings) { return settings.tail_s() * 1e3; }},
    Key{"solve.travel_weight", &setting<&S::solve, &O::travel_weight>,
        Bounds{.min = 0.0, .max = 1.0, .min_open = true}, "",
        "Weight of the nozzle's error where nothing is extruded, 1 where something is"},
    Key{"solve.along_weight", &setting<&S::solve, &O::along_weight>,
        Bounds{.min = 1e-4, .max = 1.0}, "",
        "Weight of the nozzle's error along the path, if that across it has 1. 1: the nozzle is to "
        "be in its place at the time",
        "0.01 where the base suits several models and the timing is as sliced, otherwise 1",
        &derived<&S::along_weight>},
    Key{"solve.jerk_weight", &setting<&S::solve, &O::jerk_weight>,
        Bounds{.min = 0.0, .max = 1e6, .min_open = true}, "",
        "Weight of the base's jerk against the nozzle's error",
        "15 where solve.along_weight is below 1, otherwise 1.5", &derived<&S::jerk_weight>},

    Key{"timing.tolerance_um", &setting<&S::timing, &F::tolerance_um>,
        Bounds{.min = 0.0, .max = 1000.0}, "µm",
        "How far the nozzle may stray from the path while filament is laid, for a print as fast as "
        "that allows; 0: the timing stays as sliced"},
    Key{"timing.method",
        &setting<&S::timing, &F::method>,
        kAny,
        "",
        "How such a timing is found: scaled, quickly; or optimal, which prints a little faster",
        {},
        nullptr,
        kTimingMethods},
    Key{"timing.width_tolerance", &setting<&S::timing, &F::width_tolerance>,
        Bounds{.min = 0.0, .max = 10.0}, "",
        "How far the width of a line may be off, as a share of it, where the pressure of the "
        "hotend is known; 0: it does not count"},
    Key{"timing.max_speed_mm_s", &setting<&S::timing, &F::max_speed_mm_s>, kPositive, "mm/s",
        "Speed of travel in a print with free timing", "the slicer's F"},
    Key{"timing.keep_accel_limits", &setting<&S::timing, &F::keep_accel_limits>, kAny, "",
        "Whether the accelerations that the print sets (M204, SET_VELOCITY_LIMIT) limit a free "
        "timing as well"},
    Key{"timing.outer_wall_tolerance_um", &setting<&S::timing, &F::outer_wall_tolerance_um>,
        Bounds{.min = 0.0, .max = 1000.0, .min_open = true}, "µm",
        "As tolerance_um, of outer walls", "timing.tolerance_um"},
    Key{"timing.features", &setting<&S::timing, &F::features>, kAny, "",
        "What gets a free timing, with commas between: outer_wall, inner_wall, infill, "
        "solid_infill, top, bridge, support, skirt, travel, other; or all"},
    Key{"timing.min_layer_s", &setting<&S::timing, &F::min_layer_s>,
        Bounds{.min = 0.0, .max = 600.0}, "s",
        "No layer becomes shorter than this, so that it cools, unless it was sliced so; 0: any "
        "may"},

    Key{"emit.period_ms", &setting<&S::emit, &T::period_ms>, Bounds{.min = 0.05, .max = 50.0}, "ms",
        "Node period: time between two points of the base's motion",
        "1, or a twentieth of the shorter resonance's period; up to an eleventh where its gain is "
        "small",
        &derived<&S::period_ms>},
    Key{"emit.tolerance_um", &setting<&S::emit, &T::tolerance_um>,
        Bounds{.min = 0.0, .max = 1000.0}, "µm",
        "How far a straight line may move the nozzle from where the base's own curve would have it",
        "0.25 at 45 Hz, in proportion to the lower frequency", &derived<&S::tolerance_um>},
    Key{"emit.max_lines_per_s", &setting<&S::emit, &T::max_lines_per_s>, Bounds{.min = 1.0}, "1/s",
        "Lines the printer can take in a second of print; compensated ones never exceed it",
        "Klipper 1000, Marlin 200, RRF 500, by serial 100, RRF by sbc 250",
        &derived<&S::max_lines_per_s>},
    Key{"emit.max_speed_step_mm_s", &setting<&S::emit, &T::max_speed_step_mm_s>, kPositive, "mm/s",
        "How much a motor's speed may change from line to line, where lines can be short enough"},
    Key{"emit.accel_mm_s2", &setting<&S::emit, &T::accel_mm_s2>, kPositive, "mm/s²",
        "The firmware's acceleration while it runs compensated motion",
        "1000000, RRF 5 × base.max_accel_mm_s2", &derived<&S::emit_accel_mm_s2>},
    Key{"emit.square_corner_velocity_mm_s", &setting<&S::emit, &T::square_corner_velocity_mm_s>,
        kPositive, "mm/s", "The printer's square_corner_velocity while it runs compensated motion"},
    Key{"emit.checkpoints", &setting<&S::emit, &T::checkpoints>, kAny, "",
        "Klipper: call UNFLEX_CHECKPOINT at the end of each run, where a pause then takes effect"},

    Key{"verify.step_ms", &setting<&S::verify, &V::step_ms>, Bounds{.min = 0.001, .max = 0.5}, "ms",
        "How far apart looks at the nozzle are at most"},
    Key{"verify.hold_s", &setting<&S::verify, &V::hold_s>, Bounds{.min = 0.0, .max = 10.0}, "s",
        "How long the nozzle is watched after the last move"},
};

template <std::size_t A, std::size_t B>
constexpr std::array<Key, A + B> joined(const std::array<Key, A>& first,
                                        const std::array<Key, B>& then) {
  std::array<Key, A + B> all{};
  std::ranges::copy(first, all.begin());
  std::ranges::copy(then, all.begin() + A);
  return all;
}

constexpr std::array kKeys =
    joined(joined(joined(kPrinterKeys, kEarlierKeys), kDynamicsKeys), kLaterKeys);

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
