// G0 to G3, G10 and G11: from the words of a line to segments.
#include <cmath>
#include <optional>
#include <string>
#include <string_view>

#include "arc.hpp"
#include "unflex/core/number.hpp"
#include "unflex/gcode/interpreter.hpp"

namespace unflex::gcode {
namespace {

// Below this Klipper takes a move for one that does not leave its place (toolhead.py, Move).
constexpr double kShortestMove_mm = 1e-9;
// No machine is a thousand kilometres long; beyond that a number is a mistake.
constexpr double kLargestCoordinate_mm = 1e9;
constexpr double kSecondsPerMinute = 60.0;

// Where a motion line wants the machine to be.
struct Target {
  Position position_mm{};
  std::array<bool, 4> named{};  // axes the line names …
  bool e_absolute = false;      // … E by its absolute reading
  std::optional<double> feed;   // F word
  const char* problem = nullptr;

  [[nodiscard]] bool moves() const { return named[X] || named[Y] || named[Z] || named[E]; }
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

// gcode_move.py, cmd_G1: G91 makes E relative too, whatever M82 says.
Target read_target(const Command& command, const ModalState& state) {
  Target target;
  target.position_mm = state.position_mm;
  target.e_absolute = state.absolute_xyz && state.absolute_e;
  for (const Word& word : command.words) {
    const std::optional<Axis> axis = axis_of(word.letter);
    if (!axis && word.letter != 'F') {
      continue;
    }
    if (!word.value) {
      target.problem = "a motion word has no number";
    } else if (!axis) {
      target.feed = word.value;
    } else {
      const bool is_e = *axis == E;
      const bool absolute = is_e ? target.e_absolute : state.absolute_xyz;
      const double travel = *word.value * state.unit_mm * (is_e ? state.flow_factor : 1.0);
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

// Whether the text says where a motion to the target starts.
bool starts_known(const Target& target, const ModalState& state) {
  const bool e_known = state.known[E] || !target.named[E] || !target.e_absolute;
  return state.known[X] && state.known[Y] && state.known[Z] && e_known;
}

// Once an axis has been sent to an absolute reading, its position is known. True if one was not
// known before, so that the machine may have moved where the numbers show no motion.
bool settle(const Target& target, ModalState& state) {
  bool was_unknown = false;
  for (const Axis axis : {X, Y, Z, E}) {
    const bool absolute = axis == E ? target.e_absolute : state.absolute_xyz;
    if (target.named[axis] && absolute && !state.known[axis]) {
      was_unknown = true;
      state.known[axis] = state.base_known[axis];
    }
  }
  return was_unknown;
}

double length(double dx, double dy, double dz) { return std::sqrt(dx * dx + dy * dy + dz * dz); }

// The axes of an arc: two of the plane and its normal (gcode_arcs.py).
struct ArcPlane {
  Axis alpha;
  Axis beta;
  Axis normal;
  char alpha_offset;
  char beta_offset;
};

ArcPlane arc_plane(int plane) {
  switch (plane) {
    case 18:
      return {X, Z, Y, 'I', 'K'};
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

}  // namespace

double Segment::length_xy_mm() const { return length(delta(X), delta(Y), 0.0); }

double Segment::length_mm() const { return length(delta(X), delta(Y), delta(Z)); }

void Interpreter::linear_move(Event& event) {
  const Target target = read_target(command_, state_);
  if (target.problem != nullptr) {
    return not_understood(event, target.problem);
  }
  set_feed(event, target.feed);
  if (!target.moves()) {
    return;
  }
  const bool start_known = starts_known(target, state_);
  const bool from_unknown = settle(target, state_);
  append_segment(event, target.position_mm, state_.feed_mm_s * state_.speed_factor, start_known);
  if (event.segments.empty() && from_unknown) {
    event.kind = EventKind::barrier;
  }
}

void Interpreter::arc_move(Event& event, bool clockwise) {
  if (!state_.absolute_xyz) {
    return not_understood(event, "an arc in relative mode (G91), which Klipper refuses");
  }
  const Target target = read_target(command_, state_);
  if (target.problem != nullptr) {
    return not_understood(event, target.problem);
  }
  const ArcPlane plane = arc_plane(state_.plane);
  Arc arc;
  arc.start_mm = in_plane(state_.position_mm, plane);
  arc.end_mm = in_plane(target.position_mm, plane);
  arc.clockwise = clockwise;
  const auto offset = centre_offset(command_, plane, state_.unit_mm, arc);
  if (!offset) {
    return not_understood(event, "an arc without a centre");
  }
  arc.centre_offset_mm = *offset;
  const auto ends = plan_arc(arc, options_.arc_resolution_mm);
  if (!ends) {
    return not_understood(event, "an arc of more than a million pieces");
  }
  set_feed(event, target.feed);
  const bool start_known = starts_known(target, state_);
  settle(target, state_);
  const double start_e = state_.position_mm[E];
  const double e_per_piece = (target.position_mm[E] - start_e) / static_cast<double>(ends->size());
  event.segments.reserve(ends->size());
  for (std::size_t i = 0; i < ends->size(); ++i) {
    Position next = target.position_mm;
    next[plane.alpha] = (*ends)[i][0];
    next[plane.beta] = (*ends)[i][1];
    next[plane.normal] = (*ends)[i][2];
    if (i + 1 < ends->size()) {
      next[E] = start_e + static_cast<double>(i + 1) * e_per_piece;
    }
    append_segment(event, next, state_.feed_mm_s * state_.speed_factor, start_known);
  }
}

// firmware_retraction.py, cmd_G10 and cmd_G11: a relative E move between saving and restoring the
// G-code state, so that E reads as before. The length is written with five decimals and the speed
// in whole mm/min, and the flow and speed factors apply to both.
void Interpreter::firmware_retraction(Event& event, bool retract) {
  if (!options_.firmware_retraction) {
    return;
  }
  if (!command_.words.empty()) {
    event.kind = EventKind::barrier;  // "G10 S210 P0" sets a temperature in RepRapFirmware
    return;
  }
  if (state_.retracted == retract) {
    return;
  }
  state_.retracted = retract;
  const double length_mm = retract
                               ? -options_.retract_length_mm
                               : options_.retract_length_mm + options_.unretract_extra_length_mm;
  const double speed_mm_s = retract ? options_.retract_speed_mm_s : options_.unretract_speed_mm_s;
  constexpr int kDecimals = 5;
  const double travel_mm = static_cast<double>(to_scaled(length_mm, kDecimals)) /
                           power_of_ten(kDecimals) * state_.flow_factor;
  const double feed_mm_s = std::trunc(speed_mm_s * kSecondsPerMinute) / kSecondsPerMinute;
  Position target = state_.position_mm;
  target[E] += travel_mm;
  state_.base_mm[E] += travel_mm;
  append_segment(event, target, feed_mm_s * state_.speed_factor,
                 state_.known[X] && state_.known[Y] && state_.known[Z]);
  if (event.segments.empty()) {
    event.kind = EventKind::barrier;  // the length is not known here, but the machine stops
  }
}

void Interpreter::set_feed(Event& event, std::optional<double> feed_word) {
  if (!feed_word) {
    return;
  }
  if (*feed_word > 0.0) {
    state_.feed_mm_s = *feed_word * state_.unit_mm / kSecondsPerMinute;
  } else {
    event.warnings.emplace_back("F must be above zero; it is ignored");
  }
}

void Interpreter::append_segment(Event& event, const Position& target, double feed_mm_s,
                                 bool start_known) {
  Segment segment{state_.position_mm, target, feed_mm_s, event.line.number, start_known};
  if (segment.length_mm() < kShortestMove_mm) {
    for (const Axis axis : {X, Y, Z}) {
      segment.end_mm[axis] = segment.start_mm[axis];
    }
    // Less is round-off between two ways to the same reading, not a move. (Klipper would stop for
    // it.)
    if (std::abs(segment.delta(E)) < kShortestMove_mm) {
      return;
    }
  }
  state_.position_mm = segment.end_mm;
  event.kind = EventKind::move;
  event.segments.push_back(segment);
}

}  // namespace unflex::gcode
