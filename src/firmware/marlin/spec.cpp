#include <array>

#include "marlin_integers.hpp"
#include "unflex/core/firmware_spec.hpp"

namespace unflex::firmware::marlin {
namespace {

// Limits, the shaper, what E means, and pressure advance.
constexpr std::array kAddedCodes = {201, 203, 204, 205, 593, 200, 221, 900};

}  // namespace

// Sources, of Marlin 2.1.2: Configuration.h (DEFAULT_*) and Configuration_adv.h (FWRETRACT is off,
// and the other values of retraction apply where it is switched on; SHAPING_ZETA_X);
// module/planner.cpp; gcode/gcode.cpp. docs/firmware.md says where the lines per second are from.
extern constexpr FirmwareSpec kSpec = {
    .name = "marlin",
    .brand = "Marlin",
    .reading = {.return_ends_line = true,
                .g91_covers_e = false,
                .cubes_units = true,
                .sums_e_in_single_precision = true,
                .labels_leave_out_z = true,
                .first_feed_mm_s = 4000.0 / 60.0},
    .motion = {.skips_short_moves = true,
               .plays_as_planned = false,
               .slows_at_angles = true,
               .counts_step_events = true,
               .first_step_s = 1.0 / planner::marlin::kMinRate},
    .filters = {.shaper_type = "zv", .shaper_damping_ratio = 0.15, .has_linear_advance = true},
    .writing = {.advance_command = "M900 K",
                .scales_whole_steps_of_e = true,
                .units_scale_all_words = true,
                .why_no_macros = "printer.firmware is marlin, which has no macros that a pause "
                                 "would call; docs/pausing.md says where to pause",
                .added_codes = kAddedCodes},
    .defaults = {.max_z_velocity_mm_s = 5.0,
                 .max_e_velocity_mm_s = 25.0,
                 .max_z_accel_mm_s2 = 100.0,
                 .max_e_accel_mm_s2 = 10000.0,
                 .jerk_mm_s = {10.0, 10.0, 0.3, 5.0},
                 .steps_per_mm = {80.0, 80.0, 400.0, 500.0},
                 .has_firmware_retraction = false,
                 .retract_length_mm = 3.0,
                 .retract_speed_mm_s = 45.0,
                 .unretract_speed_mm_s = 8.0,
                 .max_lines_per_s = 200.0},
    .printers = {.is_told_kinematics = false,
                 .names_klipper_too = true,
                 .has_retract_accel = true,
                 .hybrid_corexy_refusal =
                     "Marlin's MARKFORGED_XY limits by x + y in places and by x - y in others",
                 .lines_from = "Marlin from its card"}};

}  // namespace unflex::firmware::marlin
