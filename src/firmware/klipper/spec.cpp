#include <array>

#include "unflex/core/firmware_spec.hpp"
#include "unflex/core/own_marks.hpp"

namespace unflex::firmware::klipper {
namespace {

constexpr std::array<std::string_view, 5> kAddedNames = {"SET_VELOCITY_LIMIT", "SET_INPUT_SHAPER",
                                                         "SET_PRESSURE_ADVANCE", kCheckpointMacro,
                                                         kLimitsMacro};

}  // namespace

// Sources: gcode_move.py; toolhead.py; extras/gcode_arcs.py; extras/motion_queuing.py
// (SDS_CHECK_TIME); extras/shaper_defs.py (DEFAULT_DAMPING_RATIO); extras/firmware_retraction.py.
extern constexpr FirmwareSpec kSpec = {
    .name = "klipper",
    .brand = "Klipper",
    .reading = {.bad_feed = "F must be above zero, or Klipper refuses the line",
                .bare_g92_sets_all = true,
                .xz_by_right_hand = false,
                .refuses_relative_arcs = true,
                .counts_drawing_back = false,
                .too_much_filament =
                    "Klipper ends the print at such a move (max_extrude_cross_section)",
                .limits_drawing_back = true},
    .motion = {.rounds_to_steps = false,
               .has_axis_limits = false,
               .limits_extruder = true,
               .has_short_queue = false},
    .filters = {.shaper_type = "mzv",
                .shaper_is_centred = true,
                .least_scan_s = 0.001,
                .smooths_advance = true,
                .advances_in_runs = true},
    .writing = {.advance_command = "SET_PRESSURE_ADVANCE ADVANCE=",
                .can_pause_behind_run = true,
                .added_names = kAddedNames,
                .record_before = "ACCELEROMETER_MEASURE NAME={name}\n",
                .record_after = "ACCELEROMETER_MEASURE NAME={name}\n"},
    .defaults = {.jerk_mm_s = {10.0, 10.0, 0.3, 5.0},
                 .steps_per_mm = {80.0, 80.0, 400.0, 500.0},
                 .unretracts_less = false},
    .printers = {.has_all_kinematics = true,
                 .takes_a_matrix = true,
                 .lines_from = "Klipper from its own storage"}};

}  // namespace unflex::firmware::klipper
