#include <algorithm>
#include <array>

#include "firmware_commands.hpp"

namespace unflex::gcode {
namespace {

// Klipper stops where a handler calls toolhead's get_last_move_time, wait_moves, dwell or
// flush_step_generation; register_lookahead_callback only ties an action to a point of the motion.

// Handled without a stop:
//   73 117 display_status.py; 104 140 heaters.py set_temperature; 105 report; 106 107 fan.py;
//   110 115 118 gcode.py and respond.py; 114 gcode_move.py.
// Not known to Klipper, which ignores them, and not usually defined as macros. More are in
// foreign_commands.cpp.
//   74 75 76 77 78 (job records), 92 (steps), 101 103 (extruder on and off, of Skeinforge's time),
//   108, 113, 141 (chamber), 155 (reports), 200, 201 203 205 566 (limits), 207 208 209
//   (retraction), 211 (end stops), 250 (contrast), 301 304 305 (PID), 302 (cold extrusion), 350
//   (microsteps), 355 (light), 403 (MMU), 404 405 406 407 (filament width), 413 (power loss), 503,
//   540, 555 (print area), 563 567 568 (tools of RepRapFirmware), 569 (drivers), 575 (serial), 591
//   (filament sensor), 592 593 (extrusion, shaping), 620 621 (Bambu: filament change), 622 623
//   (Bambu: a condition; Klipper always runs the lines between), 624 625 (Bambu: labels),
//   906 to 914 919 920 (drivers), 960 (Bambu: lights), 993 1015 (Bambu: detectors).
// 201 203 205 566 also set Event::may_set_limits.
constexpr std::array kPassiveCodes = {
    73,  74,  75,  76,  77,  78,  92,  101, 103, 104, 105, 106, 107, 108, 110, 113, 114, 115, 117,
    118, 140, 141, 155, 200, 201, 203, 205, 207, 208, 209, 211, 250, 301, 302, 304, 305, 350, 355,
    403, 404, 405, 406, 407, 413, 503, 540, 555, 563, 566, 567, 568, 569, 575, 591, 592, 593, 620,
    621, 622, 623, 624, 625, 906, 907, 908, 909, 910, 911, 912, 913, 914, 919, 920, 960, 993, 1015};

// 17 motors on; 109 116 190 191 wait for temperatures; 119 end stops; 300 beep (a macro with a
// pause in Klipper's own examples); 400 wait. The others are usually macros that may stop: 126 127
// (valves), 150 (light), 280 (servo), 412 (filament sensor), 420 (BED_MESH_PROFILE LOAD), 572 900
// (SET_PRESSURE_ADVANCE).
constexpr std::array kStoppingCodes = {17,  109, 116, 119, 126, 127, 150, 190,
                                       191, 280, 300, 400, 412, 420, 572, 900};

// Codes with a part behind the point. Klipper knows none of them (gcode.py takes M201.2 for a
// name), and the codes themselves move nothing: 73 201 204 205 (Bambu: scales), 569 572 593
// (drivers and shaping of RepRapFirmware), 620 622 982 1002 1015 (Bambu), 862 (Prusa: printer
// check), 900.
constexpr std::array kCodesWithPoint = {73,  201, 204, 205, 569, 572,  593,
                                        620, 622, 862, 900, 982, 1002, 1015};

// UNFLEX_CHECKPOINT is the macro that unflex writes (docs/pausing.md). It does nothing unless a
// pause is wanted. After a pause, position, limits and shaper are as before.
constexpr std::array<std::string_view, 23> kPassiveNames = {
    "ECHO",
    "EXCLUDE_OBJECT_DEFINE",
    "GET_POSITION",
    "GET_RETRACTION",
    "HELP",
    "QUERY_FILAMENT_SENSOR",
    "RESPOND",
    "SAVE_VARIABLE",
    "SET_DISPLAY_GROUP",
    "SET_DISPLAY_TEXT",
    "SET_FAN_SPEED",
    "SET_FILAMENT_SENSOR",
    "SET_GCODE_VARIABLE",
    "SET_HEATER_TEMPERATURE",
    "SET_IDLE_TIMEOUT",
    "SET_LED",
    "SET_LED_TEMPLATE",
    "SET_PIN",
    "SET_SERVO",
    "SET_TEMPERATURE_FAN_TARGET",
    "STATUS",
    "TURN_OFF_HEATERS",
    "UNFLEX_CHECKPOINT",
};

// Mainsail's and Fluidd's macros turn SET_PRINT_STATS_INFO into the pause that the user has asked
// for at a layer.
constexpr std::array<std::string_view, 11> kStoppingNames = {
    "ACCELEROMETER_MEASURE",
    "ACCELEROMETER_QUERY",
    "DUMP_TMC",
    "INIT_TMC",
    "QUERY_ENDSTOPS",
    "SET_EXTRUDER_ROTATION_DISTANCE",
    "SET_PRINT_STATS_INFO",
    "SET_TMC_CURRENT",
    "SET_TMC_FIELD",
    "SYNC_EXTRUDER_MOTION",
    "TEMPERATURE_WAIT",
};

static_assert(std::is_sorted(kPassiveCodes.begin(), kPassiveCodes.end()));
static_assert(std::is_sorted(kCodesWithPoint.begin(), kCodesWithPoint.end()));
static_assert(std::is_sorted(kStoppingCodes.begin(), kStoppingCodes.end()));
static_assert(std::is_sorted(kPassiveNames.begin(), kPassiveNames.end()));
static_assert(std::is_sorted(kStoppingNames.begin(), kStoppingNames.end()));

}  // namespace

Effect klipper_m_code_effect(int number) {
  const Effect own = effect_by_lists(kPassiveCodes, kStoppingCodes, number);
  return own == Effect::unknown ? foreign_m_code_effect(number) : own;
}

Effect klipper_subcode_effect(int number) {
  return std::ranges::binary_search(kCodesWithPoint, number) ? Effect::passive : Effect::unknown;
}

Effect extended_effect(std::string_view name) {
  return effect_by_lists(kPassiveNames, kStoppingNames, name);
}

}  // namespace unflex::gcode
