#include <array>

#include "unflex/core/firmware_spec.hpp"

namespace unflex::firmware::rrf {
namespace {

// Limits, the shaper, and pressure advance.
constexpr std::array kAddedCodes = {201, 203, 204, 205, 593, 566, 572};

}  // namespace

// Sources, of RepRapFirmware 3.6: src/Config/Configuration.h (Default*); AxisShaper.h
// (DefaultDamping) and AxisShaper::Configure; Movement/Move.cpp, SetInstantDv; DDA.cpp;
// GCodes/GCodes.cpp, ReadMove and LoadExtrusionAndFeedrateFromGCode. docs/firmware.md says where
// the lines per second are from.
extern constexpr FirmwareSpec kSpec = {
    .name = "rrf",
    .brand = "RepRapFirmware",
    .reading = {.bad_feed = "F must be above zero, or the printer creeps",
                .takes_several_commands = true,
                .has_blocks = true,
                .g91_covers_e = false,
                .relative_e_keeps_reading = true,
                .refuses_short_radius = true,
                .macros_select_tools = true,
                .first_feed_mm_s = 3000.0 / 60.0},
    .motion = {.leaves_out_short_ramps = true, .corexz_lift = 3.0, .has_two_jerks = true},
    .filters = {.shaper_type = "zvd",
                .shapes_both_axes_alike = true,
                .shaper_may_come_on = true,
                .switching_grace_s = 0.010},
    .writing = {.advance_command = "M572 D0 S",
                .limits_act_early = true,
                .why_no_macros = "printer.firmware is rrf, whose pause no macro can defer; "
                                 "docs/pausing.md says where to pause",
                .added_codes = kAddedCodes,
                // A1 waits until the next move begins.
                .record_before = "M956 P0 S{samples:.0f} A1 F\"{name}.csv\"\n"},
    .defaults = {.max_z_velocity_mm_s = 20.0,
                 .max_e_velocity_mm_s = 100.0,
                 .max_z_accel_mm_s2 = 200.0,
                 .max_e_accel_mm_s2 = 500.0,
                 // DefaultPrintingAcceleration, above whatever M201 allows.
                 .command_accel_mm_s2 = 50000.0,
                 .jerk_mm_s = {15.0, 15.0, 10.0, 5.0},
                 .steps_per_mm = {80.0, 80.0, 800.0, 420.0},
                 .queue_length = 60.0,
                 .retract_length_mm = 2.0,
                 .retract_speed_mm_s = 1000.0 / 60.0,
                 .unretract_speed_mm_s = 1000.0 / 60.0,
                 .max_lines_per_s = 500.0,
                 .max_lines_per_s_of_sbc = 250.0,
                 .emit_accel_follows_base = true},
    .printers = {.takes_a_matrix = true,
                 .lines_from = "RepRapFirmware from its card",
                 .lines_from_sbc = "RepRapFirmware with its computer"}};

}  // namespace unflex::firmware::rrf
