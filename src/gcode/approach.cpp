// The approach: most of the way of a travel whose start is only assumed, as a line of its own.
// Before a line that draws from such a place, it goes to that place.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "unflex/core/math.hpp"
#include "unflex/gcode/interpreter.hpp"

namespace unflex::gcode {
namespace {

// The approach leaves this end of the way to the travel. At 5000 mm/s² this end takes 50 ms from
// rest to rest: two periods of a slow printer, in which a base can take a nozzle's swing away.
constexpr double kLeft_mm = 3.0;
// The approach makes at least this share of the way.
constexpr double kLeastShare = 0.1;
// A shorter travel gets no approach.
constexpr double kShortest_mm = 0.1;
constexpr int kDecimals = 4;
constexpr int kDecimalsOfInches = 6;

bool is_plain_move(const Command& command) {
  return command.kind == CommandKind::traditional && command.letter == 'G' && command.number >= 0 &&
         command.number <= 3 && command.subnumber == -1 && !command.line_number &&
         !command.checksum;
}

// Moves X or Y, or an arc, with filament.
bool draws(const Command& command) {
  return is_plain_move(command) && command.has('E') &&
         (command.has_any("XY") || command.number >= 2);
}

// G0 or G1 with X and Y, maybe F, each once, and nothing else that counts.
bool is_plain_travel(const Command& command) {
  if (!is_plain_move(command) || command.number > 1) {
    return false;
  }
  std::array<int, 2> seen{};
  return std::ranges::all_of(command.words,
                             [&](const Word& word) {
                               if (word.letter == 'X' || word.letter == 'Y') {
                                 return word.value && ++seen[word.letter == 'Y'] == 1;
                               }
                               return word.letter == 'F' && word.value && *word.value > 0.0;
                             }) &&
         seen[0] == 1 && seen[1] == 1;
}

}  // namespace

// The printer's own input shaper leaves no swing.
bool Interpreter::swings() const {
  constexpr double kLeast_s = 5e-3;
  return swinging_s_ > kLeast_s && !state_.shaper.is_on();
}

std::optional<std::string> Interpreter::approach(const Line& line) const {
  const std::string_view line_end = line.text.ends_with("\r\n") ? "\r\n" : "\n";
  if (swings() && draws(parse(line.content()))) {
    return fmt::format("G4 P{:.0f}{}", std::ceil(swinging_s_ * 1e3), line_end);
  }
  const std::array<bool, 4> taken = known_or_assumed();
  if (is_xy_known(state_.known) || !is_xy_known(taken)) {
    return std::nullopt;
  }
  const Command command = parse(line.content());
  if (!state_.absolute_xyz || !modes_certain()) {
    return std::nullopt;
  }
  if (draws(command)) {
    // Behind a macro E is unknown as well, and so the line stays as it is.
    return state_.known[E] ? std::optional(go_where_assumed().append(line_end)) : std::nullopt;
  }
  if (!is_plain_travel(command)) {
    return std::nullopt;
  }
  const XY zero_mm = xy_of(state_.base_mm);
  const XY from_mm = xy_of(state_.position_mm);
  const XY words{*command.value('X'), *command.value('Y')};
  const XY whole_way_mm = zero_mm + state_.unit_mm * words - from_mm;
  const double way_mm = length(whole_way_mm);
  if (!(way_mm >= kShortest_mm)) {
    return std::nullopt;
  }
  const double share = std::max(kLeastShare, 1.0 - kLeft_mm / way_mm);
  const XY reading = (from_mm + share * whole_way_mm - zero_mm) / state_.unit_mm;
  const int decimals = state_.unit_mm == 1.0 ? kDecimals : kDecimalsOfInches;
  std::string text = fmt::format("G{}", command.number);
  for_each_axis([&](std::string_view letter,
                    double value) { text += fmt::format(" {}{:.{}f}", letter, value, decimals); },
                kAxisLetters, reading);
  if (const std::optional<double> feed = command.value('F')) {
    text += fmt::format(" F{}", *feed);
  }
  return text.append(line_end);
}

// No motion, unless an object was cancelled and the machine is elsewhere. Then it goes there at the
// file's own limits, which the line itself would not do.
std::string Interpreter::go_where_assumed() const {
  constexpr double kExact = 1e9;
  std::string text = "G1";
  for_each_axis(
      [&](std::string_view letter, double position_mm, double zero_mm) {
        const double exact = (position_mm - zero_mm) / state_.unit_mm;
        text += fmt::format(" {}{}", letter, std::round(exact * kExact) / kExact + 0.0);
      },
      kAxisLetters, xy_of(state_.position_mm), xy_of(state_.base_mm));
  return text;
}

}  // namespace unflex::gcode
