// Marlin 2.1.2, src/gcode/gcode.cpp, process_parsed_command, and each command's own file. Marlin
// stops where a handler calls planner.synchronize(), or where it waits so long that the buffer runs
// empty. It echoes a code that no configuration knows as unknown and does nothing. But derived
// firmwares give many of these codes a meaning, so a code is passive only if no such meaning moves
// anything.
#include <algorithm>
#include <array>

#include "firmware_commands.hpp"

namespace unflex::gcode {
namespace {

//   10 11 vacuum; 16 printer check; 20 27 31 SD card; 42 pin; 73 75 76 77 78 progress and job
//   timer; 85 time-out; 100 102; 104 140 141 143 targets; 105 106 107 108; 110 to 123 without
//   112: line number, debugging, reports, messages, end stops; 126 to 129 valves; 145 149
//   150 154 155; 163 to 166 mixing; 211 soft end stops; 217 218 tool settings, for the next change;
//   250 255 256 display; 260 261; 280 281 282 servos; 290 babysteps, added to the steps on their
//   way; 300 beep, from a queue; 301 302 304 305 309 heaters; 355 light; 380 381 solenoids; 403 404
//   407; 412 413 414; 430; 503 504 settings are listed or checked; 510 511; 540 552 553 554 569
//   575 603 672 710 851 871; 906 to 914 and 919 drivers; 7219.
// Unknown to Marlin: 74, 555 (print area), 566 572 591 592 (RepRapFirmware's), 563 567 568 (tools
// of RepRapFirmware). More are in foreign_commands.cpp.
constexpr std::array kPassiveCodes = {
    10,  11,  16,  20,  27,  31,  42,  73,  74,  75,  76,  77,  78,  85,  100, 102, 104, 105, 106,
    107, 108, 110, 111, 113, 114, 115, 117, 118, 119, 120, 121, 122, 123, 126, 127, 128, 129, 140,
    141, 143, 145, 149, 150, 154, 155, 163, 164, 165, 166, 211, 217, 218, 250, 255, 256, 260, 261,
    280, 281, 282, 290, 300, 301, 302, 304, 305, 309, 355, 380, 381, 403, 404, 407, 412, 413, 414,
    430, 503, 504, 510, 511, 540, 552, 553, 554, 555, 563, 566, 567, 568, 569, 572, 575, 591, 592,
    603, 672, 710, 851, 871, 906, 907, 908, 909, 910, 911, 912, 913, 914, 919, 7219};

//   3 4 5 spindle or laser; 7 8 9 coolant; 12 closed loop; 17 motors on; 80 power on, waits; 109
//   190 191 192 193 wait for temperatures; 303 tunes; 400 waits.
// 500 is left out: it stores limits and shaper, which must be those of the file, not of a run. 226
// is left out too: it waits for a pin, and meanwhile the user may do anything.
constexpr std::array kStoppingCodes = {3,  4,   5,   7,   8,   9,   12,  17,
                                       80, 109, 190, 191, 192, 193, 303, 400};

static_assert(std::is_sorted(kPassiveCodes.begin(), kPassiveCodes.end()));
static_assert(std::is_sorted(kStoppingCodes.begin(), kStoppingCodes.end()));

}  // namespace

Effect marlin_m_code_effect(int number) {
  const Effect own = effect_by_lists(kPassiveCodes, kStoppingCodes, number);
  return own == Effect::unknown ? foreign_m_code_effect(number) : own;
}

}  // namespace unflex::gcode
