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
// Not known to Klipper, which ignores them, and not usually taken over by macros: 74 75 76 77 78
// (job records), 92 (steps), 108, 113, 141 (chamber), 155 (reports), 200, 201 203 205 566 (limits),
// 207 208 209 (retraction), 211 (end stops), 250 (contrast), 301 304 (PID), 302 (cold extrusion),
// 355 (light), 413 (power loss), 555 (print area), 569 (drivers), 591 (filament sensor), 592 593
// (extrusion, shaping), 862 (printer check), 906 907 (currents). For those of limits
// may_set_limits() is asked.
constexpr std::array kPassiveCodes = {73,  74,  75,  76,  77,  78,  92,  104, 105, 106, 107,
                                      108, 110, 113, 114, 115, 117, 118, 140, 141, 155, 200,
                                      201, 203, 205, 207, 208, 209, 211, 250, 301, 302, 304,
                                      355, 413, 555, 566, 569, 591, 592, 593, 862, 906, 907};

// 17 motors on; 109 116 190 191 wait for temperatures; 119 end stops; 300 beep (a macro with a
// pause in Klipper's own examples); 400 wait. Macros make SET_PRESSURE_ADVANCE of 572 and 900,
// which may stop.
constexpr std::array kStoppingCodes = {17, 109, 116, 119, 190, 191, 300, 400, 572, 900};

constexpr std::array<std::string_view, 22> kPassiveNames = {
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
};

// Of SET_PRINT_STATS_INFO Mainsail's and Fluidd's macros make the pause that the user has asked for
// at a layer.
constexpr std::array<std::string_view, 9> kStoppingNames = {
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
static_assert(std::is_sorted(kStoppingCodes.begin(), kStoppingCodes.end()));
static_assert(std::is_sorted(kPassiveNames.begin(), kPassiveNames.end()));
static_assert(std::is_sorted(kStoppingNames.begin(), kStoppingNames.end()));

}  // namespace

Effect klipper_m_code_effect(int number) {
  return effect_by_lists(kPassiveCodes, kStoppingCodes, number);
}

Effect extended_effect(std::string_view name) {
  return effect_by_lists(kPassiveNames, kStoppingNames, name);
}

}  // namespace unflex::gcode
