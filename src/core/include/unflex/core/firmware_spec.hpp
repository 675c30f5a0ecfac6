// Peculiarities of each firmware, as plain values. Its treatment of lines, motion and limits is in
// tables of functions: gcode/firmware_reader.hpp, planner/firmware_planner.hpp and
// emit/firmware_dialect.hpp. All tables of a firmware are in its folder in src/firmware.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string_view>

#include "unflex/core/firmware.hpp"
#include "unflex/core/firmware_tables.hpp"

namespace unflex {

// Peculiarities in reading lines.
struct FirmwareReading {
  const char* bad_feed = nullptr;       // what is wrong with F0; null: nothing is
  bool takes_several_commands = false;  // a line may have more than one command
  bool return_ends_line = false;        // a carriage return without a line feed
  bool has_blocks = false;              // indented lines belong to an `if` or `while`
  bool bare_g92_sets_all = false;       // G92 without words is for all axes
  bool g91_covers_e = true;
  bool cubes_units = false;               // after G20 a volume is in cubic inches
  bool relative_e_keeps_reading = false;  // relative E words leave the reading of E alone
  bool sums_e_in_single_precision = false;
  bool xz_by_right_hand = true;        // G18 takes Z before X
  bool refuses_relative_arcs = false;  // it refuses arcs under G91, and arcs with R
  bool refuses_short_radius = false;   // it refuses an R that does not reach the end
  bool counts_drawing_back = true;     // a move may draw back too much filament, too
  std::string_view too_much_filament = "no nozzle takes so much";
  bool limits_drawing_back = false;  // a move that draws back is limited by the extruder
  bool labels_leave_out_z = false;   // behind an object's label a move of Z may be missing
  bool macros_select_tools = false;  // a macro may select another tool
  double first_feed_mm_s = 25.0;     // until the first F
};

// Peculiarities in moving.
struct FirmwareMotion {
  bool rounds_to_steps = true;  // lines begin and end on whole steps
  bool has_axis_limits = true;  // each axis has limits of its own, not all motion together
  bool limits_extruder =
      false;  // it limits jumps of flow, and acceleration while filament is drawn back
  bool has_short_queue = true;     // the lookahead is no longer than the queue of lines
  bool skips_short_moves = false;  // a move of too few steps is made with the next one
  bool plays_as_planned = true;
  bool slows_at_angles = false;     // the angle between short lines limits the speed
  bool counts_step_events = false;  // each line's clock goes by its steps
  bool leaves_out_short_ramps = false;
  double first_step_s = 0.0;   // how long the first step from rest waits
  double corexz_lift = 1.0;    // travel of the Z part of a CoreXZ's motors, per mm
  bool has_two_jerks = false;  // one of two jerks is for prints alone
};

// The firmware's input shaper and pressure advance.
struct FirmwareFilters {
  std::string_view shaper_type = {};    // if none is told
  double shaper_damping_ratio = 0.1;    // if none is told
  bool shaper_is_centred = false;       // the pulses lie around the planned time, not behind it
  bool shapes_both_axes_alike = false;  // there is one shaper
  bool shaper_may_come_on = false;      // a macro may switch it on, whatever is configured
  double switching_grace_s = 0.0;       // how much longer than its pulses a switch takes
  // Where filters are switched, the firmware scans for steps this long before and after, at least;
  // 0: it does not scan.
  double least_scan_s = 0.0;
  bool has_linear_advance = false;  // printer.linear_advance_s is its pressure advance
  bool smooths_advance = false;
  bool advances_in_runs = false;  // its own pressure advance can serve in compensated runs
};

// Peculiarities of the text that is written for the firmware.
struct FirmwareWriting {
  std::string_view advance_command = {};  // followed by the advance in s
  bool limits_act_early = false;          // limits also hold for the move in the line before
  bool scales_whole_steps_of_e = false;
  bool units_scale_all_words = false;   // G20 also scales words of lines without motion
  bool can_pause_behind_run = false;    // macros let a pause wait for a run's end
  std::string_view why_no_macros = {};  // the error for a user who asks for macros
  // The codes (M) and names of commands that unflex adds.
  std::span<const int> added_codes = {};
  std::span<const std::string_view> added_names = {};
  // The lines before and after a move whose stop is recorded, with {name} and {samples}; empty:
  // there is no command for it.
  std::string_view record_before = {};
  std::string_view record_after = {};
};

// Values of settings that no source gives. Their origins are cited where the values stand.
struct FirmwareDefaults {
  // Limits of Z and E. Unset: the limits of all motion hold.
  std::optional<double> max_z_velocity_mm_s = {}, max_e_velocity_mm_s = {};
  std::optional<double> max_z_accel_mm_s2 = {}, max_e_accel_mm_s2 = {};
  std::optional<double> command_accel_mm_s2 = {};  // M204; unset: the largest acceleration
  std::array<double, 4> jerk_mm_s{};
  std::array<double, 4> steps_per_mm{};
  double queue_length = 16.0;
  bool has_firmware_retraction = true;
  double retract_length_mm = 0.0;
  double retract_speed_mm_s = 20.0;
  double unretract_speed_mm_s = 10.0;
  bool unretracts_less = true;  // the extra length of G11 may be negative
  double max_lines_per_s = 1000.0;
  std::optional<double> max_lines_per_s_of_sbc = {};  // with a computer attached
  bool emit_accel_follows_base = false;               // the acceleration of compensated lines
};

// Facts about printers that run the firmware.
struct FirmwarePrinters {
  bool is_told_kinematics = true;  // the printer tells which motors move what
  bool names_klipper_too = false;  // slicers also give its name to printers with Klipper
  bool has_retract_accel = false;  // M204 R
  std::string_view hybrid_corexy_refusal = {};  // why it cannot plan for one; empty: it can
  bool has_all_kinematics = false;
  bool takes_a_matrix = false;       // from motors to axes, in its configuration
  std::string_view lines_from = {};  // where lines come from, unless a host sends them
  std::string_view lines_from_sbc = {};
};

struct FirmwareSpec {
  std::string_view name = {};   // as the configuration spells it
  std::string_view brand = {};  // as its makers write it
  FirmwareReading reading = {};
  FirmwareMotion motion = {};
  FirmwareFilters filters = {};
  FirmwareWriting writing = {};
  FirmwareDefaults defaults = {};
  FirmwarePrinters printers = {};
};

UNFLEX_FIRMWARE_TABLES(FirmwareSpec, kSpec)

[[nodiscard]] inline const FirmwareSpec& spec_of(Firmware firmware) {
  return UNFLEX_TABLE_OF(firmware, kSpec);
}

}  // namespace unflex
