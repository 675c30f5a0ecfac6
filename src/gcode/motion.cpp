// G0 to G3: from the words of a line to segments.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "arc.hpp"
#include "firmware_reader.hpp"
#include "unflex/core/firmware_spec.hpp"
#include "unflex/core/math.hpp"
#include "unflex/gcode/interpreter.hpp"

namespace unflex::gcode {
namespace {

// Klipper takes a shorter move for one that does not leave its place (toolhead.py, Move).
constexpr double kShortestMove_mm = 1e-9;
// No machine is a thousand kilometres long; beyond that a number is a mistake.
constexpr double kLargestCoordinate_mm = 1e9;
constexpr double kSecondsPerMinute = 60.0;
// Largest gap between an arc's end and its circle without a warning. Rounding to three digits
// leaves a smaller gap on an arc of any size.
constexpr double kLargestGap_mm = 0.1;

// Where a motion line wants the machine to be.
struct Target {
  Position position_mm{};
  std::array<bool, 4> named{};  // axes that the line names
  bool e_absolute = false;      // E words are absolute readings
  std::optional<double> feed;   // F word
  bool feed_is_none = false;
  const char* problem = nullptr;

  [[nodiscard]] bool moves() const { return std::ranges::any_of(named, std::identity{}); }
};

std::optional<Axis> axis_of(char letter) {
  switch (letter) {
    case 'X':
      return X;
    case 'Y':
      return Y;
    case 'Z':
      return Z;
    case 'E':
      return E;
    default:
      return std::nullopt;
  }
}

// Names the problem of a speed that is not above zero. Klipper refuses the line (gcode_move.py,
// cmd_G1), RepRapFirmware goes on at its minimum speed. Marlin does not mind.
const char* problem_of_feed(double feed, Firmware firmware) {
  return feed > 0.0 ? nullptr : spec_of(firmware).reading.bad_feed;
}

// A line with several commands, or with one word twice, was hardly meant so. Klipper and Marlin
// take the last of equal words and ignore a second command. RepRapFirmware's lines of this kind are
// dealt with in rrf.cpp.
std::string_view oddity(const Command& command) {
  unsigned seen = 0;
  for (const Word& word : command.words) {
    if (word.letter == 'G' || word.letter == 'M' || word.letter == 'T') {
      return "the second command in the line counts for nothing; give it a line of its own";
    }
    const unsigned bit = 1U << static_cast<unsigned>(word.letter - 'A');
    if ((seen & bit) != 0U) {
      return "a word is given twice, and the last one counts; check the line";
    }
    seen |= bit;
  }
  return "";
}

void remark_oddity(Event& event, const Command& command, Firmware firmware) {
  if (const std::string_view remark = oddity(command);
      !spec_of(firmware).reading.takes_several_commands && !remark.empty()) {
    event.warnings.emplace_back(remark);
  }
}

// Klipper: gcode_move.py, cmd_G1. Marlin: gcode.cpp, get_destination_from_command. RepRapFirmware:
// GCodes.cpp, DoStraightMove and LoadExtrusionAndFeedrateFromGCode.
Target read_target(const Command& command, const ModalState& state, Firmware firmware) {
  Target target;
  target.position_mm = state.position_mm;
  target.e_absolute = state.e_is_absolute();
  for (const Word& word : command.words) {
    const std::optional<Axis> axis = axis_of(word.letter);
    if (!axis && word.letter != 'F') {
      continue;
    }
    if (!word.value) {
      target.problem = "a motion word has no number";
    } else if (!axis) {
      target.feed = word.value;
      if (const char* const problem = problem_of_feed(*word.value, firmware)) {
        target.problem = problem;
        target.feed_is_none = true;
      }
    } else {
      const bool is_e = *axis == E;
      const bool absolute = is_e ? target.e_absolute : state.absolute_xyz;
      const double travel = *word.value * (is_e ? state.filament_per_e_mm() : state.unit_mm);
      const double origin = absolute ? state.base_mm[*axis] : state.position_mm[*axis];
      target.position_mm[*axis] = origin + travel;
      target.named[*axis] = true;
      if (!(std::abs(target.position_mm[*axis]) <= kLargestCoordinate_mm)) {
        target.problem = "the move leads further than any machine reaches";
      }
    }
  }
  return target;
}

// Whether the text says where a motion to the target starts. Z may be unknown if the motion is in
// the XY plane and the line does not name Z.
bool starts_known(const Target& target, const std::array<bool, 4>& known, bool in_xy_plane = true) {
  const bool e_known = known[E] || !target.named[E] || !target.e_absolute;
  const bool z_known = known[Z] || (in_xy_plane && !target.named[Z]);
  return is_xy_known(known) && z_known && e_known;
}

// Once an axis has been sent to an absolute reading, its position is known. True if it was unknown
// for some axis. Then the machine may have moved although the numbers show no motion.
bool settle(const Target& target, ModalState& state) {
  bool was_unknown = false;
  for (const Axis axis : kXYZE) {
    const bool absolute = axis == E ? target.e_absolute : state.absolute_xyz;
    if (target.named[axis] && absolute && !state.known[axis]) {
      was_unknown = true;
      state.known[axis] = true;
    }
  }
  return was_unknown;
}

double length(double dx, double dy, double dz) { return std::sqrt(dx * dx + dy * dy + dz * dz); }

// The axes of an arc: two of the plane and its normal.
struct ArcPlane {
  Axis alpha;
  Axis beta;
  Axis normal;
  char alpha_offset;
  char beta_offset;
};

// In G18 Klipper takes X before Z. The other firmwares take Z before X, by the right-hand rule.
ArcPlane arc_plane(int plane, Firmware firmware) {
  switch (plane) {
    case 18:
      return spec_of(firmware).reading.xz_by_right_hand ? ArcPlane{Z, X, Y, 'K', 'I'}
                                                        : ArcPlane{X, Z, Y, 'I', 'K'};
    case 19:
      return {Y, Z, X, 'J', 'K'};
    default:
      return {X, Y, Z, 'I', 'J'};
  }
}

std::array<double, 3> in_plane(const Position& position, const ArcPlane& plane) {
  return {position[plane.alpha], position[plane.beta], position[plane.normal]};
}

// The offset of the centre from the start; nullopt if the line gives none.
std::optional<std::array<double, 2>> centre_offset(const Command& command, const ArcPlane& plane,
                                                   double unit_mm, const Arc& arc) {
  if (command.has('R')) {
    const double radius_mm = command.value('R').value_or(0.0) * unit_mm;
    return radius_mm == 0.0
               ? std::nullopt
               : centre_from_radius(arc.start_mm, arc.end_mm, radius_mm, arc.clockwise);
  }
  for (const char letter : {plane.alpha_offset, plane.beta_offset}) {
    if (command.has(letter) && !command.value(letter)) {
      return std::nullopt;
    }
  }
  const std::array<double, 2> offset = {command.value(plane.alpha_offset).value_or(0.0) * unit_mm,
                                        command.value(plane.beta_offset).value_or(0.0) * unit_mm};
  if (offset[0] == 0.0 && offset[1] == 0.0) {
    return std::nullopt;
  }
  return offset;
}

// Why the firmware refuses an arc of this kind; nullptr if it does not.
const char* refusal_of_arc(const FirmwareReading& reading, const Command& command,
                           const ModalState& state) {
  if (reading.refuses_relative_arcs && !state.absolute_xyz) {
    return "an arc in relative mode (G91), which Klipper refuses";
  }
  if (reading.refuses_relative_arcs && command.has('R')) {
    return "an arc with R, which Klipper refuses";
  }
  return nullptr;
}

// RepRapFirmware abandons the print if the radius is too small by more than 1 %.
bool radius_reaches(const Command& command, double unit_mm, const Arc& arc) {
  const double radius_mm = command.value('R').value_or(0.0) * unit_mm;
  const double half_chord_mm =
      0.5 * math::hypot(arc.end_mm[0] - arc.start_mm[0], arc.end_mm[1] - arc.start_mm[1]);
  constexpr double kMissingShare = 0.02;
  return radius_mm * radius_mm * (1.0 + kMissingShare) >= half_chord_mm * half_chord_mm;
}

// The arc that a line draws in its plane, or why it draws none.
struct DrawnArc {
  Arc arc;
  const char* problem = nullptr;
};

DrawnArc drawn_arc(const Command& command, const ModalState& state, const Position& end_mm,
                   const ArcPlane& plane, const FirmwareReading& reading, bool clockwise) {
  DrawnArc drawn;
  Arc& arc = drawn.arc;
  arc.start_mm = in_plane(state.position_mm, plane);
  arc.end_mm = in_plane(end_mm, plane);
  arc.clockwise = clockwise;
  const auto offset = centre_offset(command, plane, state.unit_mm, arc);
  if (!offset) {
    drawn.problem = "an arc without a centre";
  } else if (reading.refuses_short_radius && command.has('R') &&
             !radius_reaches(command, state.unit_mm, arc)) {
    drawn.problem = "an arc whose radius is too small to reach its end";
  } else {
    arc.centre_offset_mm = *offset;
  }
  return drawn;
}

// Where a piece of an arc ends that is not the last one.
Position end_of_piece(const ArcPiece& piece, const ArcPlane& plane, const Position& arc_start_mm,
                      const Position& arc_end_mm) {
  Position end_mm = arc_end_mm;
  for (const Axis axis : {plane.normal, E}) {
    end_mm[axis] = arc_start_mm[axis] + (arc_end_mm[axis] - arc_start_mm[axis]) * piece.share;
  }
  end_mm[plane.alpha] = piece.end_mm[0];
  end_mm[plane.beta] = piece.end_mm[1];
  return end_mm;
}

// How far the end is from the circle on which the arc starts.
double gap_at_end_mm(const Arc& arc) {
  const double x = arc.start_mm[0] + arc.centre_offset_mm[0];
  const double y = arc.start_mm[1] + arc.centre_offset_mm[1];
  return std::abs(math::hypot(arc.end_mm[0] - x, arc.end_mm[1] - y) -
                  math::hypot(arc.centre_offset_mm[0], arc.centre_offset_mm[1]));
}

void warn_of_gap(Event& event, const Arc& arc) {
  if (const double gap_mm = gap_at_end_mm(arc); gap_mm > kLargestGap_mm) {
    event.warnings.push_back(
        fmt::format("the arc's end is {:.2f} mm off its circle: the printer goes there straight; "
                    "check the line",
                    gap_mm));
  }
}

// Computes the readings of E at both ends of the segment, in the firmware's single precision.
ReadingOfE follow_reading_of_e(const Segment& segment, ModalState& state) {
  // Sums in single precision drift from ours. A reading that differs by more has been set (G10,
  // G11, tools).
  constexpr double kDrift_mm = 1e-3;
  constexpr double kDriftShare = 1e-5;
  const auto reading = [&](const Position& position) {
    return (position[E] - state.base_mm[E]) / state.filament_factor();
  };
  const double start = reading(segment.start_mm);
  const double end = reading(segment.end_mm);
  ReadingOfE result;
  result.start = state.e_reading_single;
  result.factor = static_cast<float>(state.filament_factor());
  if (!(std::abs(start - result.start) < kDrift_mm + kDriftShare * std::abs(start))) {
    result.start = static_cast<float>(start);
  }
  result.end = state.e_is_absolute() ? static_cast<float>(end)
                                     : result.start + static_cast<float>(end - start);
  state.e_reading_single = result.end;
  return result;
}

// The warning for a move that has too much filament.
std::string too_much_filament(const Segment& segment, Firmware firmware) {
  return fmt::format(
      "{:.4g} mm of filament in {:.4g} mm of path: {}; passed through unchanged, check the line",
      segment.delta(E), segment.length_mm(), spec_of(firmware).reading.too_much_filament);
}

}  // namespace

double Segment::length_xy_mm() const { return std::sqrt(squared(way_xy_mm())); }

double Segment::length_mm() const { return length(delta(X), delta(Y), delta(Z)); }

// A line of motion after which the position is not known. Tells which words are to blame, and what
// path it draws. `known`: which axes were known before it.
void Interpreter::note_lost_motion(Event& event, const std::array<bool, 4>& known) {
  std::string letters;
  for (const Word& word : command_.words) {
    if (std::string_view("ABCDPSUVW").find(word.letter) != std::string_view::npos) {
      letters += letters.empty() ? "" : ", ";
      letters += word.letter;
    }
  }
  if (event.warnings.empty() && !letters.empty()) {
    event.warnings.push_back(
        fmt::format("G{} with {}, which unflex does not understand here: passed through unchanged; "
                    "check the line",
                    command_.number, letters));
  }
  const Target target = read_target(command_, state_, options_.firmware);
  const Position& from = state_.position_mm;
  if (target.problem == nullptr && is_xy_known(known) && target.position_mm[E] > from[E]) {
    event.lost_path_mm = std::sqrt(squared(xy_of(target.position_mm) - xy_of(from)));
  }
}

// RepRapFirmware: relative E words do not change the reading that absolute ones refer to
// (GCodes.cpp, LoadExtrusionAndFeedrateFromGCode, latestVirtualExtruderPosition).
void Interpreter::keep_reading_of_e(bool e_absolute, double before_mm) {
  if (spec_of(options_.firmware).reading.relative_e_keeps_reading && !e_absolute) {
    state_.base_mm[E] += state_.position_mm[E] - before_mm;
  }
}

void Interpreter::linear_move(Event& event) {
  const Target target = read_target(command_, state_, options_.firmware);
  if (target.problem != nullptr) {
    feed_uncertain_ = feed_uncertain_ || target.feed_is_none;
    return not_understood(event, target.problem);
  }
  remark_oddity(event, command_, options_.firmware);
  set_feed(target.feed);
  if (!target.moves()) {
    return;
  }
  const bool brings_z_back = z_left_out_ && target.named[Z] && state_.absolute_xyz;
  z_left_out_ = z_left_out_ && !brings_z_back;
  Start start;
  start.known = starts_known(target, state_.known) && modes_certain() && !brings_z_back;
  start.assumed = !start.known && starts_known(target, known_or_assumed()) && modes_certain();
  const bool from_unknown = settle(target, state_) || brings_z_back;
  const double e_before_mm = state_.position_mm[E];
  append_segment(event, target.position_mm, state_.feed_mm_s * state_.speed_factor, start);
  keep_reading_of_e(target.e_absolute, e_before_mm);
  if (event.segments.empty() && from_unknown) {
    event.kind = start.assumed ? EventKind::border : EventKind::barrier;
  }
}

void Interpreter::arc_move(Event& event, bool clockwise) {
  const FirmwareReading& reading = spec_of(options_.firmware).reading;
  if (const char* const refusal = refusal_of_arc(reading, command_, state_)) {
    return not_understood(event, refusal);
  }
  const Target target = read_target(command_, state_, options_.firmware);
  if (target.problem != nullptr) {
    feed_uncertain_ = feed_uncertain_ || target.feed_is_none;
    return not_understood(event, target.problem);
  }
  remark_oddity(event, command_, options_.firmware);
  const ArcPlane plane = arc_plane(state_.plane, options_.firmware);
  const auto [arc, problem] =
      drawn_arc(command_, state_, target.position_mm, plane, reading, clockwise);
  if (problem != nullptr) {
    return not_understood(event, problem);
  }
  set_feed(target.feed);
  const double feed_mm_s = state_.feed_mm_s * state_.speed_factor;
  const ArcPieces pieces =
      reader_of(options_.firmware).plan_arc(arc, feed_mm_s, command_, options_);
  if (!pieces) {
    return not_understood(event, "an arc of too many pieces");
  }
  if (pieces->empty()) {
    return not_understood(event, "an arc of no angle, which Marlin leaves out");
  }
  if (state_.known[plane.alpha] && state_.known[plane.beta]) {
    warn_of_gap(event, arc);
  }
  const bool in_xy_plane = plane.normal == Z;
  Start start;
  start.known = starts_known(target, state_.known, in_xy_plane) && modes_certain();
  start.assumed =
      !start.known && starts_known(target, known_or_assumed(), in_xy_plane) && modes_certain();
  settle(target, state_);
  const Position start_mm = state_.position_mm;
  const double radius_mm = math::hypot(arc.centre_offset_mm[0], arc.centre_offset_mm[1]);
  event.segments.reserve(pieces->size());
  for (std::size_t i = 0; i < pieces->size(); ++i) {
    const bool is_last = i + 1 == pieces->size();
    const Position next = is_last ? target.position_mm
                                  : end_of_piece((*pieces)[i], plane, start_mm, target.position_mm);
    append_segment(event, next, feed_mm_s, start, i == 0 || is_last ? 0.0 : radius_mm);
  }
  keep_reading_of_e(target.e_absolute, start_mm[E]);
}

void Interpreter::set_feed(std::optional<double> feed_word) {
  if (feed_word && *feed_word > 0.0) {
    state_.feed_mm_s = *feed_word * state_.unit_mm / kSecondsPerMinute;
    feed_uncertain_ = false;
  }
}

std::array<bool, 4> Interpreter::known_or_assumed() const {
  std::array<bool, 4> known = state_.known;
  for (const Axis axis : kXY) {
    known[axis] = known[axis] || assumed_[axis];
  }
  return known;
}

void Interpreter::append_segment(Event& event, const Position& target, double feed_mm_s,
                                 const Start& start, double curve_radius_mm) {
  Segment segment{state_.position_mm, target,        feed_mm_s,      event.line.number,
                  start.known,        start.assumed, curve_radius_mm};
  if (segment.length_mm() < kShortestMove_mm) {
    for (const Axis axis : kXYZ) {
      segment.end_mm[axis] = segment.start_mm[axis];
    }
    // A smaller change of E is round-off between two ways to the same reading, not a move. (Klipper
    // would stop for it.)
    if (std::abs(segment.delta(E)) < kShortestMove_mm) {
      return;
    }
  }
  const double filament_mm = segment.delta(E);
  // Klipper limits what is pulled back in another way.
  const double counted_mm =
      spec_of(options_.firmware).reading.counts_drawing_back ? std::abs(filament_mm) : filament_mm;
  segment.too_much_filament = segment.moves_xy() && counted_mm > options_.max_extrude_dab_mm &&
                              counted_mm > options_.max_extrude_ratio * segment.length_mm();
  if (segment.too_much_filament && event.warnings.empty()) {
    event.warnings.push_back(too_much_filament(segment, options_.firmware));
  }
  if (segment.moves_xy()) {
    // From a known place the compensated base takes the swing away.
    swinging_s_ = start.known || start.assumed ? 0.0 : options_.settling_s;
  } else {
    // Ramps make the motion last longer than this.
    const double least_s = std::max(segment.length_mm(), std::abs(filament_mm)) / feed_mm_s;
    swinging_s_ = std::max(swinging_s_ - least_s, 0.0);
  }
  if (spec_of(options_.firmware).reading.sums_e_in_single_precision) {
    segment.reading_of_e = follow_reading_of_e(segment, state_);
  }
  state_.position_mm = segment.end_mm;
  event.kind = EventKind::move;
  event.segments.push_back(segment);
}

}  // namespace unflex::gcode
