#include "unflex/gcode/unknown_command.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>

#include "firmware_commands.hpp"
#include "firmware_reader.hpp"
#include "unflex/gcode/command.hpp"
#include "unflex/gcode/rrf_meta.hpp"

namespace unflex::gcode {
namespace {

// Codes that the interpreters handle, and codes that by their meaning move the machine or wait for
// the user in every firmware that has them:
//   G: 27 parks, 28 homes, 29 30 32 34 38 probe and level.
constexpr std::array kKnownGCodes = {0,  1,  2,  3,  4,  10, 11, 17, 18, 19, 20, 21, 27, 28,
                                     29, 30, 32, 34, 38, 53, 60, 90, 91, 92, 93, 94, 392};
//   M: 0 1 25 125 226 600 601 602 pauses, 2 24 32 112 524 control the print, 18 84 motors off, 48
//   probes, 500 501 502 settings, 701 702 filament.
constexpr std::array kKnownMCodes = {0,   1,   2,   18,  24,  25,  32,  48,  82,  83,  84,  92,
                                     109, 112, 116, 120, 121, 125, 200, 201, 203, 204, 205, 207,
                                     208, 209, 220, 221, 226, 290, 486, 500, 501, 502, 524, 566,
                                     572, 579, 591, 592, 593, 600, 601, 602, 603, 701, 702, 900};

static_assert(std::is_sorted(kKnownGCodes.begin(), kKnownGCodes.end()));
static_assert(std::is_sorted(kKnownMCodes.begin(), kKnownMCodes.end()));

constexpr std::array<std::string_view, 4> kKnownNames = {"RESTORE_GCODE_STATE", "SET_GCODE_OFFSET",
                                                         "TUNING_TOWER", "RESPOND"};

bool is_known(const Command& command, Firmware firmware) {
  switch (command.letter) {
    case 'G':
      return std::ranges::binary_search(kKnownGCodes, command.number);
    case 'M':
      return asks_host_to_act(command) ||
             std::ranges::binary_search(kKnownMCodes, command.number) ||
             (command.subnumber < 0 &&
              reader_of(firmware).m_code_effect(command.number) != Effect::unknown);
    default:
      return command.letter == 'T';
  }
}

}  // namespace

std::string unknown_command(const Event& event, Firmware firmware) {
  if (!event.position_lost || !event.warnings.empty()) {
    return {};
  }
  const std::string_view content = event.line.content();
  if (reader_of(firmware).is_meta_command(content)) {
    return {};
  }
  const Command command = parse(content);
  switch (command.kind) {
    case CommandKind::traditional:
      if (is_known(command, firmware)) {
        return {};
      }
      return command.subnumber < 0
                 ? fmt::format("{}{}", command.letter, command.number)
                 : fmt::format("{}{}.{}", command.letter, command.number, command.subnumber);
    case CommandKind::extended:
      return std::ranges::find(kKnownNames, command.name) == kKnownNames.end() ? command.name : "";
    case CommandKind::none:
    case CommandKind::malformed:
      break;
  }
  return {};
}

}  // namespace unflex::gcode
