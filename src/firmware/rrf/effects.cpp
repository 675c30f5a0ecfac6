// RepRapFirmware 3.5, src/GCodes/GCodes2.cpp, HandleMcode. It stops where a handler calls
// LockCurrentMovementSystemAndWaitForStandstill or LockAllMovementSystemsAndWaitForStandstill.
// Codes that GCodeQueue.cpp, ShouldQueueMCode, names are tied to their place in the motion instead.
// For a code it does not know, it looks for a macro file of that name (TryMacroFile), which may do
// anything.
#include <algorithm>
#include <array>

#include "firmware_commands.hpp"

namespace unflex::gcode {
namespace {

//   Queued: 3 4 5 spindle, 42 pin, 104 106 107 117 140 141 144 280 300 568.
//   20 21 22 27 30 36 38 39 files; 73 progress; 80 power; 85; 102 ignored; 105 108 110 111 114 115
//   118 119 122 reports; 143 heater protection; 208 axis ends; 260 261; 290 baby steps, pushed into
//   the moves on their way; 292; 301 304 305 307 308 309 heaters; 374 376 404 407 408 409 450; 470
//   471 472; 500 503; 540 550 to 555; 557 558; 562 564; 567; 570 571; 575 576; 581; 586 to 589; 591
//   592; 905; 911 912; 929; 950 to 957 but 952 and 954.
constexpr std::array kPassiveCodes = {
    3,   4,   5,   20,  21,  22,  27,  30,  36,  38,  39,  42,  73,  80,  85,  102, 104, 105, 106,
    107, 108, 110, 111, 114, 115, 117, 118, 119, 122, 140, 141, 143, 144, 208, 260, 261, 280, 290,
    292, 300, 301, 304, 305, 307, 308, 309, 374, 376, 404, 407, 408, 409, 450, 470, 471, 472, 500,
    503, 540, 550, 551, 552, 553, 554, 555, 557, 558, 562, 564, 567, 568, 570, 571, 575, 576, 581,
    586, 587, 588, 589, 591, 592, 905, 911, 912, 929, 950, 951, 953, 955, 956, 957};

//   17 motors on; 81 power off at the end; 116 109 190 191 wait for temperatures; 150 LEDs of some
//   kinds; 302 cold extrusion; 350 microsteps; 400 waits; 505; 569 drivers (GCodes3.cpp);
//   572 pressure advance (Move.cpp); 574 end stops; 577 waits for an input; 595 the queue; 906 913
//   917 currents; 915 stall detection; 918.
constexpr std::array kStoppingCodes = {17,  81,  116, 150, 190, 191, 302, 350, 400, 505,
                                       569, 572, 574, 577, 595, 906, 913, 915, 917, 918};

static_assert(std::is_sorted(kPassiveCodes.begin(), kPassiveCodes.end()));
static_assert(std::is_sorted(kStoppingCodes.begin(), kStoppingCodes.end()));

}  // namespace

Effect rrf_m_code_effect(int number) {
  const Effect own = effect_by_lists(kPassiveCodes, kStoppingCodes, number);
  return own == Effect::unknown ? foreign_m_code_effect(number) : own;
}

// Moves, retractions and the codes that wait for their turn among the moves: HandleGcode,
// HandleMcode, and ShouldQueueMCode in GCodeQueue.cpp.
bool rrf_waits_for_buffer(const Command& command) {
  constexpr std::array kMoves = {0, 1, 2, 3, 10, 11};
  constexpr std::array kQueued = {3,   4,   5,   42,  104, 106, 107, 117,
                                  140, 141, 144, 150, 280, 300, 568};
  if (command.kind != CommandKind::traditional) {
    return false;
  }
  return command.letter == 'G'
             ? std::ranges::binary_search(kMoves, command.number)
             : command.letter == 'M' && std::ranges::binary_search(kQueued, command.number);
}

}  // namespace unflex::gcode
