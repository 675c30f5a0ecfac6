// The printer and how unflex should treat it: validated values, where each came from, and the TOML
// they are read from.
#pragma once

#include <array>
#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "unflex/core/axes.hpp"
#include "unflex/core/error.hpp"
#include "unflex/core/firmware.hpp"
#include "unflex/core/kinematics.hpp"
#include "unflex/gcode/feature.hpp"
#include "unflex/machine/dynamics.hpp"
#include "unflex/machine/print_text.hpp"

namespace unflex {
struct FirmwareSpec;
}

namespace unflex::machine {

struct Range {
  double min = 0.0;
  double max = 0.0;
};

// Two numbers, of which either may be the larger.
using Pair = std::array<double, 2>;

// One value for each of X Y Z E; unset where none is given.
using AxisOptions = std::array<std::optional<double>, 4>;

// Marlin: how it draws arcs.
struct MarlinArcs {
  double min_segment_mm = 0.1;        // MIN_ARC_SEGMENT_MM
  double max_segment_mm = 1.0;        // MAX_ARC_SEGMENT_MM
  double segments_per_s = 0.0;        // ARC_SEGMENTS_PER_SEC; 0: not configured
  double min_circle_segments = 72.0;  // MIN_CIRCLE_SEGMENTS, a whole number
  double correction_interval = 25.0;  // N_ARC_CORRECTION, a whole number
  bool p_circles = false;             // ARC_P_CIRCLES
};

// Marlin: how fast it passes from one move to the next.
struct MarlinJunctions {
  bool classic_jerk = false;           // CLASSIC_JERK instead of junction deviation
  double min_steps_per_segment = 6.0;  // MIN_STEPS_PER_SEGMENT, a whole number
  bool handle_small_segments = true;   // JD_HANDLE_SMALL_SEGMENTS
  double minimum_speed_mm_s = 0.05;    // MINIMUM_PLANNER_SPEED
};

// The steps that the board and the drivers can make. 0 and "": no limit.
struct BoardSettings {
  double max_step_rate_hz = 0.0;        // of each motor
  double max_total_step_rate_hz = 0.0;  // of all motors together
  std::string driver;
  std::string mcu;
};

// The printer's own input shaper.
struct InputShaperSettings {
  // Frequencies that [input_shaper] is set back to after the print (its type stays). 0: the printer
  // has none. Unset: not known on Klipper, where every printer may have one; elsewhere none.
  Axes<std::optional<double>> freq_hz;
  // Type as the firmware spells it; "auto": what the firmware takes if it is told none.
  // RepRapFirmware forgets the type when its shaper is switched off (M593 P). Klipper may have
  // another type along Y.
  Axes<std::string> type{"auto", "auto"};  // Y "auto": as along X
  // Unset: the firmware's default.
  Axes<std::optional<double>> damping_ratio;
};

struct PrinterSettings {
  Firmware firmware = Firmware::klipper;
  // The variant of the firmware, if it is not its makers' own (docs/compatibility.md). "auto": as
  // recognised; "mainline": its makers' own, whatever was recognised.
  std::string variant = "auto";
  std::string version;             // as the firmware tells it; empty: not known
  std::string transport = "auto";  // how lines reach the firmware: "card", "serial", "sbc"
  // Where the base may be. Unset: not limited, except that it stays above 0 where the path does.
  Axes<std::optional<Range>> travel_mm;
  bool relative_extrusion = false;  // the printer is in M83 when a print begins
  // [firmware_retraction] is configured; lengths as in the printer's configuration.
  bool firmware_retraction = true;
  // Unset: the firmware's defaults.
  std::optional<double> retract_length_mm;
  std::optional<double> retract_speed_mm_s;
  double unretract_extra_length_mm = 0.0;
  std::optional<double> unretract_speed_mm_s;
  double retract_z_hop_mm = 0.0;   // Marlin and RepRapFirmware
  double arc_resolution_mm = 1.0;  // [gcode_arcs] resolution
  // Unset: the firmware's default for Marlin and RepRapFirmware, not known for Klipper.
  AxisOptions steps_per_mm;
  BoardSettings board;
  // Marlin.
  MarlinJunctions junctions;
  MarlinArcs arcs;
  bool ft_motion = false;         // M493 S1: fixed-time motion is on
  double linear_advance_s = 0.0;  // M900 K, 0 without LIN_ADVANCE
  std::optional<double>
      queue_length;                 // moves the firmware plans ahead; unset: the firmware's default
  double step_clock_hz = 750000.0;  // RepRapFirmware, StepClockRate
  InputShaperSettings input_shaper;
};

// Steps per second that the printer's board and drivers can make; infinity where nothing limits
// them.
struct StepLimits {
  double max_hz;         // of each motor
  double max_total_hz;   // of all motors together
  double max_shared_hz;  // of all motors together, while more than one moves

  [[nodiscard]] bool is_any() const;
};

// Limits that the firmware sets by M201, M203 and so on are named by what they limit.
// docs/configuration.md tells which key is which command.
struct LimitSettings {
  double max_velocity_mm_s = 300.0;
  double max_accel_mm_s2 = 5000.0;
  double square_corner_velocity_mm_s = 5.0;
  double minimum_cruise_ratio = 0.5;
  // Klipper has these for Z alone; unset: max_velocity_mm_s and max_accel_mm_s2. With other
  // firmwares unset X and Y are max_velocity_mm_s and max_accel_mm_s2, unset Z and E the firmware's
  // default.
  AxisOptions axis_max_velocity_mm_s;
  AxisOptions axis_max_accel_mm_s2;
  AxisOptions jerk_mm_s;  // Marlin with classic jerk, RepRapFirmware; unset: the firmware's default
  AxisOptions print_jerk_mm_s;                // RepRapFirmware, M205; unset: jerk_mm_s
  std::optional<double> print_accel_mm_s2;    // unset: Marlin max_accel_mm_s2, RRF no limit
  std::optional<double> travel_accel_mm_s2;   // unset: like print_accel_mm_s2
  std::optional<double> retract_accel_mm_s2;  // Marlin; unset: max_accel_mm_s2
  double junction_deviation_mm = 0.013;       // Marlin
  double min_velocity_mm_s = 0.0;             // Marlin
  double min_travel_velocity_mm_s = 0.0;      // Marlin
  double min_segment_time_ms = 20.0;          // Marlin
  double min_movement_velocity_mm_s = 0.5;    // RepRapFirmware
  double jerk_policy = 0.0;                   // RepRapFirmware, 0 or 1
};

struct ExtruderSettings {
  double nozzle_diameter_mm = 0.4;
  double filament_diameter_mm = 1.75;       // that the print is sliced for
  std::optional<double> filament_area_mm2;  // section that is material; unset: of that diameter
  std::string filament_profile;             // table of it along the spool; empty: none
  double filament_density_g_cm3 = 1.24;     // PLA's
  double filament_start_mm = 0.0;           // where on the spool the print begins
  std::optional<double> max_extrude_cross_section_mm2;   // unset: 4 · nozzle², as in Klipper
  std::optional<double> max_extrude_only_velocity_mm_s;  // unset: Klipper's formula
  std::optional<double> max_extrude_only_accel_mm_s2;    // unset: Klipper's formula
  std::optional<double> max_flow_mm3_s;                  // unset: not limited
  double instantaneous_corner_velocity_mm_s = 1.0;
  // The printer's own pressure advance, if the print does not set it: Klipper's [extruder], M572 of
  // RepRapFirmware. Marlin's is PrinterSettings::linear_advance_s. In Klipper pressure advance
  // decides how long a switch of the shaper takes.
  double pressure_advance_s = 0.0;
  double pressure_advance_smooth_s = 0.04;

  // Whether moves that print need another length of filament than they were sliced with.
  [[nodiscard]] bool fits_filament() const {
    return filament_area_mm2.has_value() || !filament_profile.empty();
  }
};

// The shape of a pressure that is proportional to the flow.
inline constexpr std::string_view kLinearPressure = "linear";

// The filament that is pressed together in the hotend (unflex/dynamics/hotend_pressure.hpp), and
// whether unflex makes up for it.
struct PressureSettings {
  // unset: only where the printer's own pressure advance does it, smoothed over less time
  std::optional<bool> written;
  std::optional<double> advance_s;  // unset: what the printer's own pressure advance is set to
  std::string shape{kLinearPressure};
  double offset_mm = 0.0;
  double knee_mm_s = 1.0;
  double second_advance_s = 0.0;
  double dead_time_ms = 0.0;
  double max_extruder_accel_mm_s2 = 10000.0;
  double line_width_mm = 0.45;  // of a line that is laid, to tell widths in µm
};

// The hotend as two lags behind a dead time (unflex/hotend/plant.hpp), and what is done with it.
// `unflex hotend` finds it and tunes by it.
struct HotendSettings {
  std::optional<double> gain_c;  // for each count of power
  std::optional<double> time_constant_s;
  double sensor_lag_s = 0.0;
  std::optional<double> dead_time_s;
  double ambient_c = 25.0;
  std::optional<double> heater_w;  // at full power
  // How far the temperature may be from its target while filament is laid.
  double band_c = 5.0;
  bool ahead = false;                  // changes of temperature are asked for ahead
  std::string ahead_when = "heating";  // or "both"

  [[nodiscard]] bool has_model() const { return gain_c && time_constant_s && dead_time_s; }
};

struct KinematicsSettings {
  Kinematics type = Kinematics::cartesian;
  // Travel of each motor per mm of X, Y and Z. Only for the types "linear", where all must be set,
  // and "tripteron", whose own rows are in force while these are unset.
  std::array<std::optional<Motors::Row>, Motors::kCount> joints;
  // Where the motors' joints are when the tool is at 0, 0, 0. Unset: as the legs tell, or 0.
  std::optional<Motors::Row> offset_mm;
  // Where the tool is after G28, for unflex translate. Unset: not known.
  std::optional<Motors::Row> home_mm;
  // Where each motor's joint may be. Unset: not limited.
  std::array<std::optional<Range>, Motors::kCount> range_mm;
  // The legs of a tripteron, one number or place for each: docs/kinematics.md. All are set, or none
  // is, and then the reach of the legs is not known.
  std::optional<Pair> bars_mm;  // upper, lower
  std::optional<Motors::Row> rail_y_mm;
  std::optional<Motors::Row> rail_z_mm;
  std::array<std::optional<Motors::Row>, Motors::kCount> tool_joint_mm;
  // Angles of the legs' elbows, 0 where a leg is straight. Unset: 0 to 180.
  std::optional<Range> elbow_deg;
};

// Limits of each motor.
struct BaseSettings {
  std::optional<double> max_velocity_mm_s;  // unset: Settings::base_max_velocity_mm_s()
  // Unset: 2 · Settings::most_of_motor() · limits.max_accel_mm_s2.
  std::optional<double> max_accel_mm_s2;
  double max_jerk_mm_s3 = 0.0;  // 0: not limited
};

struct SolveSettings {
  double window_s = 2.0;    // core of a window in a run too long for one
  double overlap_s = 0.06;  // pre-roll and post-roll of such a window
  double lead_in_ms = 0.0;  // the base may start this much before the plan does
  std::optional<double>
      tail_ms;  // the base may settle this much longer; unset: see Settings::tail_s()
  double travel_weight = 0.1;  // weight of the error where nothing is extruded
  // Weight of the error along the path, if that across it has 1. Unset: 0.01 where the base is to
  // suit several models of an axis and the timing is as sliced, otherwise 1.
  std::optional<double> along_weight;
  // Regularisation (docs/theory.md). Unset: 1.5, or 15 where along_weight is below 1.
  std::optional<double> jerk_weight;
};

inline constexpr std::string_view kAllFeatures = "all";

// The method that finds a free timing (unflex/timing/timing.hpp).
inline constexpr std::string_view kScaled = "scaled";
inline constexpr std::string_view kOptimal = "optimal";

// Timing that is as fast as a tolerance of the nozzle allows, instead of as sliced
// (docs/timing.md).
struct TimingSettings {
  double tolerance_um = 0.0;    // 0: the timing stays as sliced
  std::string method{kScaled};  // or kOptimal
  // The width of a line may be off by this share of itself, where pressure is written. 0: the width
  // may be any.
  double width_tolerance = 0.1;
  std::optional<double> max_speed_mm_s;           // of travel; unset: the slicer's F
  bool keep_accel_limits = false;                 // those of the plan as sliced
  std::optional<double> outer_wall_tolerance_um;  // unset: tolerance_um
  // Kinds whose timing is free: kAllFeatures, or gcode::kFeatureWords with commas.
  std::string features{kAllFeatures};
  double min_layer_s = 0.0;  // a layer is made no shorter; 0: as short as it comes out

  [[nodiscard]] bool is_optimal() const { return method == kOptimal; }
  [[nodiscard]] std::vector<std::string_view> feature_words() const;
  [[nodiscard]] double tolerance_of_um(gcode::FeatureKind kind) const;
  // Whether moves of the kind get another timing than sliced.
  [[nodiscard]] bool is_free(gcode::FeatureKind kind) const;
};

struct EmitSettings {
  // Node period; unset: 1 ms, or AxisDynamics::good_period_ms() if that is shorter.
  std::optional<double> period_ms;
  // How far the shape of a line may move the nozzle. Unset: 0.25 µm at 45 Hz, in proportion to the
  // lower frequency, so that lines per second hardly depend on it.
  std::optional<double> tolerance_um;
  std::optional<double> max_lines_per_s;  // hard limit; unset: by firmware
  double max_speed_step_mm_s = 30.0;      // from line to line, per motor
  // The firmware's acceleration inside a compensated run; unset: 1e6, with RepRapFirmware 5 times
  // the base's.
  std::optional<double> accel_mm_s2;
  double square_corner_velocity_mm_s = 1000.0;
  // Klipper: each run's end calls the macro at which a pause takes effect.
  bool checkpoints = false;
};

// The base may use this share of the largest change of speed from line to line. The lines use the
// rest to make up for each other.
inline constexpr double kSpeedStepShare = 0.93;
// The firmware's own acceleration in a run over the base's, at least.
inline constexpr double kEmitAccelFactor = 5.0;

// The firmware's clock differs a little from line to line. This room keeps the lines that begin
// within any 100 ms within the budget all the same.
inline constexpr double kClockRoom = 1.002;

struct VerifySettings {
  double step_ms = 0.5;
  double hold_s = 0.5;
};

// The origin of a key that no source gives.
inline constexpr std::string_view kDefaultOrigin = "default";

struct Settings {
  PrinterSettings printer;
  LimitSettings limits;
  ExtruderSettings extruder;
  PressureSettings pressure;
  HotendSettings hotend;
  Axes<AxisDynamics> dynamics;
  SwingSettings swing;
  std::vector<ToolSettings> tools;  // by rising numbers; empty: all tools are alike
  DynamicsError dynamics_error;
  SecondSettings second;
  KinematicsSettings kinematics;
  BaseSettings base;
  SolveSettings solve;
  TimingSettings timing;
  EmitSettings emit;
  VerifySettings verify;
  // Where each key in force came from ("limits.max_accel_mm_s2" → "printer.toml:7", "--set",
  // "default"), one entry for every known key, in the order of the documentation, then one for each
  // key that a tool gives.
  std::vector<std::pair<std::string, std::string>> origins;
  // Remarks for the user about the settings that were read.
  std::vector<Diagnostic> notes;
  // Facts that decide over the result, but that no source gives, so that a default stands for them:
  // resonances, or the firmware of a print that was sliced for another one than the default. The
  // program refuses to compensate by a guess, and tells of it where it measures by one.
  std::vector<Diagnostic> guesses;
  // Why no print is compensated for this printer, and the way out (docs/compatibility.md).
  std::optional<Diagnostic> refusal;

  // Whether the timing is chosen by a tolerance, and not as sliced.
  [[nodiscard]] bool is_timing_free() const { return timing.tolerance_um > 0.0; }
  // The largest tolerance that holds for the nozzle anywhere. 0: the timing is as sliced.
  [[nodiscard]] double largest_tolerance_um() const;

  // Checks values that were set in code as if a printer file held them: each must be in its range,
  // and all must fit each other. Errors are of kind usage and name the keys. Settings from load()
  // are checked already.
  [[nodiscard]] Status validate() const;

  // The firmware's peculiarities (core/firmware_spec.hpp).
  [[nodiscard]] const FirmwareSpec& spec() const;

  // The values behind unset options, by the firmware's own formulas and defaults.
  [[nodiscard]] std::array<double, 4> axis_max_velocity_mm_s() const;
  [[nodiscard]] std::array<double, 4> axis_max_accel_mm_s2() const;
  [[nodiscard]] std::array<double, 4> jerk_mm_s() const;
  // RepRapFirmware: the jerk of prints, and whether M205 sets it apart from M566's.
  [[nodiscard]] std::array<double, 4> print_jerk_mm_s() const;
  [[nodiscard]] bool has_print_jerk() const;
  [[nodiscard]] std::array<double, 4> steps_per_mm() const;
  // The smallest of the limits that printer.max_step_rate_hz, max_total_step_rate_hz, driver
  // and mcu set.
  [[nodiscard]] StepLimits step_limits() const;
  [[nodiscard]] double queue_length() const;
  [[nodiscard]] double retract_length_mm() const;
  [[nodiscard]] double retract_speed_mm_s() const;
  [[nodiscard]] double unretract_speed_mm_s() const;
  [[nodiscard]] double print_accel_mm_s2() const;
  [[nodiscard]] double travel_accel_mm_s2() const;
  [[nodiscard]] double retract_accel_mm_s2() const;
  [[nodiscard]] double max_lines_per_s() const;
  // The shortest line that the budget of lines and the nodes allow.
  [[nodiscard]] double min_line_s() const;
  // The emit.max_speed_step_mm_s below which the base could not accelerate enough.
  [[nodiscard]] double least_speed_step_mm_s() const;
  [[nodiscard]] double filament_area_mm2() const;
  [[nodiscard]] double filament_g_per_mm() const;
  // Whether some axis' frequencies change while a print goes on.
  [[nodiscard]] bool changes() const;
  [[nodiscard]] double max_extrude_cross_section_mm2() const;
  [[nodiscard]] double max_extrude_only_velocity_mm_s() const;
  [[nodiscard]] double max_extrude_only_accel_mm_s2() const;
  // Whether the firmware's own advance, smoothed over less time, does what the hotend needs.
  [[nodiscard]] bool printer_presses() const;
  // Whether runs press filament together as the hotend needs it.
  [[nodiscard]] bool writes_pressure() const;
  // The motors of `kinematics`.
  [[nodiscard]] Motors motors() const;
  // A bound of what the plan may ask of a motor of X and Y, relative to the limits. Klipper limits
  // what the tool does, the other firmwares what the motors do.
  [[nodiscard]] double most_of_motor() const;
  // The limits of a motor of X and Y by the printer's own limits, and the key that sets the
  // acceleration.
  [[nodiscard]] double motor_max_velocity_mm_s() const;
  [[nodiscard]] double motor_max_accel_mm_s2() const;
  [[nodiscard]] std::string_view motor_max_accel_key() const;
  [[nodiscard]] double base_max_velocity_mm_s() const;
  // The acceleration that a motor may have in a run whose plan accelerates X or Y by up to
  // `asked_mm_s2`. A print may set more than the printer's own limit.
  [[nodiscard]] double base_max_accel_mm_s2(double asked_mm_s2) const;
  [[nodiscard]] double base_max_accel_mm_s2() const { return base_max_accel_mm_s2(0.0); }
  // base_max_accel_mm_s2() over what the plan asks; 0: it does not follow the plan.
  [[nodiscard]] double base_accel_times_asked() const;
  [[nodiscard]] double tail_s() const;
  // The share by which the frequencies may be off. A band of 10 % costs little where they are
  // right, and at 5 % off it is better than a band of 5 % (docs/theory.md).
  [[nodiscard]] double freq_error() const;
  // Whether the base is to suit more models than the axes as given.
  [[nodiscard]] bool has_several_models() const;
  [[nodiscard]] double along_weight() const;
  [[nodiscard]] double jerk_weight() const;
  // The value of jerk_weight() if along_weight() is 1.
  [[nodiscard]] double tracking_jerk_weight() const;
  // The shorter AxisDynamics::good_period_ms() of both axes.
  [[nodiscard]] double good_period_ms() const;
  [[nodiscard]] double period_ms() const;
  [[nodiscard]] double tolerance_um() const;
  [[nodiscard]] double emit_accel_mm_s2(double asked_mm_s2) const;
  [[nodiscard]] double emit_accel_mm_s2() const { return emit_accel_mm_s2(0.0); }
  // 0 where the printer has no shaper, or where none is known.
  [[nodiscard]] Axes<double> shaper_freq_hz() const;
  // Klipper: whether the printer may have a shaper that no source tells of.
  [[nodiscard]] Axes<bool> shaper_unknown() const;
  [[nodiscard]] Axes<std::string> shaper_type() const;
  [[nodiscard]] Axes<double> shaper_damping_ratio() const;
};

// The sources of settings.
struct Sources {
  const PrintText* print = nullptr;         // the print they are for, if it is at hand
  std::optional<std::string> printer_file;  // --printer
  std::vector<std::string> overrides;       // --set, "key=value"
  // If no source names a firmware, take the one that the print was sliced for. If this is false,
  // take the default: many printers are sliced for as if they had another firmware.
  bool firmware_as_sliced = false;
  // The firmware moves each of X, Y and Z by a motor of its own. Then kinematics.type must not be
  // from the configuration of the firmware itself, and resonances are not asked for.
  bool is_firmware_plain = false;
};

// Reads the settings: defaults, then what the print's slicer says of the printer, then the printer
// file, then the overrides in their order, then validation. The printer file is told by its
// content: unflex's own TOML, Klipper's printer.cfg with what it includes, what Marlin answers to
// M503, or RepRapFirmware's config.g. Unknown keys, wrong types and values out of range are errors
// of kind usage with their place ("printer.toml:7: …", or the text of the override) and a remedy.
[[nodiscard]] Result<Settings> load(const Sources& sources);

// Whether a file that was looked at describes a printer itself, and is no print.
[[nodiscard]] bool describes_printer(const PrintText& text);

// Reads the settings without a print.
[[nodiscard]] Result<Settings> load(const std::optional<std::string>& printer_file,
                                    const std::vector<std::string>& overrides);

// Reads the settings from the text of a printer file; `name` stands for the file in messages.
[[nodiscard]] Result<Settings> parse(std::string_view text, const std::string& name,
                                     const std::vector<std::string>& overrides);

// Every key with its value in force as TOML text, and where it came from as a comment. Read again
// it gives the same values.
[[nodiscard]] std::string to_toml(const Settings& settings);

// (key, value in force as TOML writes it, origin) for every key, in the order of the documentation.
struct SettingRow {
  std::string key;
  std::string value;
  std::string origin;
};
[[nodiscard]] std::vector<SettingRow> rows(const Settings& settings);

}  // namespace unflex::machine
