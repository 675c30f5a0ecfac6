#include "unflex/gcode/extrusion_mode.hpp"

#include <string>

namespace unflex::gcode {
namespace {

// The most filament laid per mm of path: a line 1.2 mm wide and 0.6 mm high, 1.75 mm filament.
constexpr double kDensest = 0.3;
constexpr std::size_t kEnoughPairs = 40;
// If E words are differences, about half are smaller than the previous one. If they are readings, E
// falls only in wipes, and rarely to less than a single move lays. So a larger share of falls means
// differences.
constexpr double kShare = 0.2;

}  // namespace

Status ExtrusionModeCheck::add(const gcode::Event& event, const gcode::ModalState& after,
                               const std::string& file) {
  const double reading_mm = after.position_mm[gcode::E] - after.base_mm[gcode::E];
  double length_mm = 0.0;
  for (const gcode::Segment& segment : event.segments) {
    length_mm += segment.length_xy_mm();
  }
  if (!after.e_is_absolute() || (length_mm <= 0.0 && reading_mm != last_mm_)) {
    last_mm_.reset();
    return {};
  }
  if (length_mm <= 0.0 || reading_mm == last_mm_) {
    return {};
  }
  if (last_mm_) {
    ++pairs_;
    const bool falls = reading_mm < *last_mm_;
    falls_ += falls && reading_mm > 0.0 && reading_mm < kDensest * length_mm ? 1 : 0;
  }
  last_mm_ = reading_mm;
  if (pairs_ < kEnoughPairs || static_cast<double>(falls_) < kShare * static_cast<double>(pairs_)) {
    return {};
  }
  return fail(ErrorKind::input, {file, event.line.number},
              "E goes up and down from move to move as if it were relative, but nothing in the "
              "file has said M83; put M83 before its first move, or set "
              "printer.relative_extrusion = true if the printer is in that mode when a print "
              "begins");
}

}  // namespace unflex::gcode
