// M-codes that none of the three firmwares knows. Slicers write them for other printers, and a file
// made for such a printer is often printed on another one. Klipper (gcode.py, cmd_default) and
// Marlin (gcode.cpp, unknown_command_warning) answer "Unknown command" and go on. RepRapFirmware
// does so too, unless there is a macro of that name.
#include <algorithm>
#include <array>

#include "firmware_commands.hpp"

namespace unflex::gcode {
namespace {

// Firmwares that know these codes set, show or record something with them and move nothing:
//   Repetier (Commands.cpp): 202 acceleration of travel, 210 homing speed.
//   MakerBot, Sailfish: 70 message, 72 song, 136 137 begin and end of a build.
//   Prusa (Prusa-Firmware-Buddy, src/marlin_stubs/gcode.cpp): 142 heat break, 330 to 334 metrics,
//   707 708 registers of the MMU, 862 printer check, 863 864 865 tools and filaments.
//   Bambu (BambuStudio, resources/profiles/BBL/machine; OpenBambuAPI, gcode.md): 969 973 977
//   scanner and camera, 971 picture of a time lapse, 974 975 982 vibration and noise, 981 spaghetti
//   detector, 991 layer has changed, 1002 messages and flags, 1003 power loss, 1004 1005 geometry,
//   1006 sound, 1007 mass.
// Codes that calibrate by moving are left out: 970 972 976 980 983 984. So are 620 to 625, because
// Bambu's firmware may skip the lines they control. Klipper skips nothing there, so
// klipper_commands.cpp lists them as passive.
constexpr std::array kPassiveCodes = {70,  72,  136, 137, 142, 202,  210,  330,  331,  332,  333,
                                      334, 707, 708, 862, 863, 864,  865,  969,  971,  973,  974,
                                      975, 977, 981, 982, 991, 1002, 1003, 1004, 1005, 1006, 1007};

static_assert(std::is_sorted(kPassiveCodes.begin(), kPassiveCodes.end()));

}  // namespace

Effect foreign_m_code_effect(int number) {
  return std::ranges::binary_search(kPassiveCodes, number) ? Effect::passive : Effect::unknown;
}

}  // namespace unflex::gcode
