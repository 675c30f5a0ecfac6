#include "unflex/gcode/compensable.hpp"

#include <algorithm>
#include <cmath>

#include "unflex/core/firmware_spec.hpp"
#include "unflex/gcode/command.hpp"

namespace unflex::gcode {
namespace {

// An absolute E word that repeats the last one can leave a difference, if E was brought there in
// five decimals. Such a difference pulls nothing back: a step of an extruder is fifty times as
// long.
constexpr double kFilamentRoundoff_mm = 2e-5;

bool has_axis_word(const Command& command) {
  return std::any_of(command.words.begin(), command.words.end(), [](const Word& word) {
    return std::string_view("XYZE").find(word.letter) != std::string_view::npos;
  });
}

bool is_motion_command(const Command& command) {
  return command.kind == CommandKind::traditional && command.letter == 'G' && command.number >= 0 &&
         command.number <= 3 && has_axis_word(command);
}

}  // namespace

std::string_view kept_reason(const Segment& segment, Firmware firmware) {
  if (!segment.start_known) {
    return "start unknown";
  }
  if (segment.too_much_filament) {
    return "too much filament";
  }
  const double length_xy = segment.length_xy_mm();
  if (length_xy == 0.0) {
    return segment.delta(Z) == 0.0 ? "extrude only" : "Z move";
  }
  if (spec_of(firmware).reading.limits_drawing_back && segment.delta(E) < -kFilamentRoundoff_mm) {
    return "retracting move";
  }
  return std::abs(segment.delta(Z)) <= kMaxSlope * length_xy ? "" : "Z move";
}

bool compensable(const Segment& segment, Firmware firmware) {
  return kept_reason(segment, firmware).empty();
}

bool compensable(const Event& event, Firmware firmware) {
  return event.kind == EventKind::move && !event.segments.empty() &&
         std::all_of(event.segments.begin(), event.segments.end(),
                     [&](const Segment& segment) { return compensable(segment, firmware); });
}

bool names_position(std::string_view content) {
  // Most lines without effect are comments, so we look before we parse.
  const std::size_t first = content.find_first_not_of(" \t");
  return first != std::string_view::npos &&
         std::string_view("GgNn").find(content[first]) != std::string_view::npos &&
         is_motion_command(parse(content));
}

}  // namespace unflex::gcode
