#include "text_machine.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <utility>

namespace unflex::testing {
namespace {

constexpr std::size_t E = 3;
constexpr std::array<std::string_view, 4> kAxes = {"X", "Y", "Z", "E"};
constexpr double kInch_mm = static_cast<double>(25.4F);  // a float in Marlin and RepRapFirmware
constexpr double kTurn = 2.0 * std::numbers::pi;

}  // namespace

// Feeds before any F: gcode_move.py, __init__; motion.cpp, DEFAULT_FEEDRATE_MM_M; Configuration.h,
// DefaultFeedRate.
TextMachine::TextMachine(Firmware firmware, Retraction retraction)
    : firmware_(firmware), retraction_(retraction), line_(firmware, "") {
  reading_.feed_mm_s = is(Firmware::klipper) ? 25.0 : is(Firmware::marlin) ? 4000.0 / 60.0 : 50.0;
}

void TextMachine::read(std::string_view text) {
  path_.clear();
  line_ = TextLine(firmware_, text);
  const Reading before = reading_;
  try {
    carry_out();
  } catch (const Refused&) {
    ++refused_;
  }
  update();
  note_waiting(before);
}

// GCodes2.cpp, HandleGcode() and HandleMcode(): a move waits for the buffer; G4, G28, M18, M84,
// M400 and M593 wait for standstill. No limit is known to wait.
void TextMachine::note_waiting(const Reading& before) {
  // The firmware drops a move of less than a step.
  constexpr double kLessThanAStep_mm = 1e-4;
  constexpr std::string_view kMoves = " G0 G1 G2 G3 G10 G11 ";
  constexpr std::string_view kStops = " G4 G28 M18 M84 M400 M593 ";
  const std::string command = " " + line_.command() + " ";
  if (kMoves.find(command) != std::string_view::npos) {
    double most_mm = path_.size() > 1 ? 1.0 : std::abs(reading_.filament_mm - before.filament_mm);
    for (std::size_t axis = 0; axis < E; ++axis) {
      most_mm = std::max(most_mm, std::abs(reading_.position_mm[axis] - before.position_mm[axis]));
    }
    move_waits_ = is(Firmware::rrf) && most_mm > kLessThanAStep_mm;
  } else if (kStops.find(command) != std::string_view::npos) {
    move_waits_ = false;
  }
}

void TextMachine::carry_out() {
  constexpr unsigned kKlipper = 1;
  constexpr unsigned kMarlin = 2;
  constexpr unsigned kRrf = 4;
  constexpr unsigned kOthers = kMarlin | kRrf;
  constexpr unsigned kAll = kKlipper | kOthers;
  using M = TextMachine;
  struct Row {
    std::string_view commands;
    unsigned firmwares;
    void (*handle)(M&);
  };
  static constexpr Row kRows[] = {
      {" G0 G1 ", kAll, [](M& m) { m.straight(); }},
      {" G2 G3 ", kAll, [](M& m) { m.arc(); }},
      {" G10 ", kAll, [](M& m) { m.retract(true, -m.retraction_.length_mm); }},
      {" G11 ", kAll,
       [](M& m) { m.retract(false, m.retraction_.length_mm + m.retraction_.extra_mm); }},
      {" G20 ", kAll, [](M& m) { m.use_inches(); }},
      {" G21 ", kAll, [](M& m) { m.reading_.inches = false; }},
      {" G28 ", kAll, [](M& m) { m.home(); }},
      {" G90 ", kAll, [](M& m) { m.set_relative(false); }},
      {" G91 ", kAll, [](M& m) { m.set_relative(true); }},
      {" M82 ", kAll, [](M& m) { m.absolute_e_words_ = true; }},
      {" M83 ", kAll, [](M& m) { m.absolute_e_words_ = false; }},
      {" G92 ", kKlipper, [](M& m) { m.klipper_g92(); }},
      {" G92 ", kMarlin, [](M& m) { m.marlin_g92(); }},
      {" G92 ", kRrf, [](M& m) { m.rrf_g92(); }},
      {" M18 M84 ", kAll, [](M& m) { m.motors_off(); }},
      {" M220 ", kAll,
       [](M& m) { m.reading_.speed_factor = m.percentage(m.reading_.speed_factor); }},
      {" M221 ", kAll, [](M& m) { m.set_flow(); }},
      {" M201 M203 M204 M205 ", kOthers, [](M& m) { m.set_limits(); }},
      {" M566 ", kRrf, [](M& m) { m.set_limits(); }},
      {" M204 ", kKlipper, [](M& m) { m.set_klipper_accel(); }},
      {" SET_VELOCITY_LIMIT SET_INPUT_SHAPER ", kKlipper, [](M& m) { m.set_klipper_limits(); }},
      {" M593 ", kMarlin, [](M& m) { m.set_marlin_shaper(); }},
      {" M593 ", kRrf, [](M& m) { m.set_rrf_shaper(); }},
      {" SAVE_GCODE_STATE ", kKlipper, [](M& m) { m.save_state(); }},
      {" RESTORE_GCODE_STATE ", kKlipper, [](M& m) { m.restore_state(); }},
      {" SET_GCODE_OFFSET ", kKlipper, [](M& m) { m.set_gcode_offset(); }},
      // Commands that change nothing in a reading.
      {"  G4 G17 M73 M104 M105 M106 M107 M109 M110 M115 M117 M118 M140 M190 M400 M486 T0 ", kAll,
       [](M& /*m*/) {}},
      {" EXCLUDE_OBJECT_DEFINE EXCLUDE_OBJECT_START EXCLUDE_OBJECT_END ", kKlipper,
       [](M& /*m*/) {}}};
  const unsigned bit = 1U << static_cast<unsigned>(firmware_);
  const std::string command = " " + line_.command() + " ";
  const auto* const row = std::ranges::find_if(kRows, [&](const Row& candidate) {
    return (candidate.firmwares & bit) != 0 &&
           candidate.commands.find(command) != std::string_view::npos;
  });
  if (is_special() || row == std::end(kRows)) {
    not_followed_.insert(line_.command());
  } else {
    row->handle(*this);
  }
}

// A cancelled object, a stored or restored factor, offsets of a tool, or a move to an endstop or
// restore point.
bool TextMachine::is_special() const {
  return (is("M486") && has_any_of("CPU")) || (is("M220") && has_any_of("BR")) ||
         (is(Firmware::rrf) &&
          (line_.has_second_command() || (is("G10") && has_any_of("LPRSXYZ")) ||
           ((is("G0") || is("G1")) && has_any_of("HR"))));
}

double TextMachine::in_mm(double value) const {
  return reading_.inches ? kept(value * kInch_mm) : value;
}

std::optional<double> TextMachine::length_mm(std::string_view word) const {
  const std::optional<double> value = number(word);
  return value ? std::optional(in_mm(*value)) : std::nullopt;
}

// gcode_move.py, cmd_G1: in Klipper, G91 makes E relative too.
void TextMachine::update() {
  const bool klipper = is(Firmware::klipper);
  reading_.absolute_e = absolute_e_words_ && (reading_.absolute_xyz || !klipper);
  for (std::size_t axis = 0; axis < E; ++axis) {
    reading_.position_mm[axis] = at_[axis] + shift_mm_[axis];
    reading_.offset_mm[axis] = base_[axis] + shift_mm_[axis];
  }
  reading_.e_reading_mm = klipper ? (at_[E] - base_[E]) / reading_.flow_factor : at_[E];
}

// gcode_move.py, cmd_G1; gcode.cpp, get_destination_from_command(); GCodes.cpp, DoStraightMove()
// and LoadExtrusionAndFeedrateFromGCode().
//
// Klipper's coordinate of E includes the flow factor. Marlin applies the factor to all moves of E
// (planner.cpp, _populate_block()). RepRapFirmware applies it to arcs and to lines that name an
// axis, whether it moves or not. RepRapFirmware does not count a relative E in its coordinate.
TextMachine::Goal TextMachine::goal() const {
  Goal goal{at_, 0.0};
  for (std::size_t axis = 0; axis < kAxes.size(); ++axis) {
    if (const std::optional<double> word = length_mm(kAxes[axis])) {
      const bool absolute = axis == E ? reading_.absolute_e : reading_.absolute_xyz;
      const bool scaled = axis == E && is(Firmware::klipper);
      const double value = scaled ? *word * reading_.flow_factor : *word;
      goal.at[axis] = kept(value + (absolute ? base_[axis] : at_[axis]));
    }
  }
  goal.filament_mm = goal.at[E] - at_[E];
  if (is(Firmware::rrf) && !reading_.absolute_e) {
    goal.filament_mm = length_mm("E").value_or(0.0);
    goal.at[E] = at_[E];
  }
  const bool with_axes = has_any_of("XYZ") || is("G2") || is("G3");
  if (is(Firmware::marlin) || (is(Firmware::rrf) && with_axes)) {
    goal.filament_mm *= reading_.flow_factor;
  }
  return goal;
}

// Klipper refuses an F of 0 or less; Marlin ignores it.
void TextMachine::take_feed() {
  const std::optional<double> feed = length_mm("F");
  if (!feed || (is(Firmware::marlin) && *feed <= 0.0)) {
    return;
  }
  if (is(Firmware::klipper) && *feed <= 0.0) {
    throw Refused{};
  }
  reading_.feed_mm_s = *feed / 60.0;
}

void TextMachine::go_to(const Goal& goal) {
  if (!path_.empty() || !std::equal(at_.begin(), at_.begin() + E, goal.at.begin())) {
    path_.push_back(
        {goal.at[0] + shift_mm_[0], goal.at[1] + shift_mm_[1], goal.at[2] + shift_mm_[2]});
  }
  at_ = goal.at;
  reading_.filament_mm += goal.filament_mm;
}

void TextMachine::straight() {
  const Goal target = goal();
  take_feed();
  go_to(target);
}

// gcode_arcs.py, _cmd_inner and planArc; G2_G3.cpp, G2_G3() and plan_arc(); GCodes.cpp,
// DoArcMove(). The points are on the circle, a degree apart, and not where the firmware's chords
// end.
void TextMachine::arc() {
  const bool klipper = is(Firmware::klipper);
  const bool marlin = is(Firmware::marlin);
  const bool clockwise = is("G2");
  const Goal target = goal();
  if (klipper && (!reading_.absolute_xyz || has("R"))) {
    throw Refused{};
  }
  if (marlin) {
    take_feed();  // even if there is no arc
  }
  std::array<double, 2> from{};
  std::array<double, 2> to{};
  for (std::size_t axis = 0; axis < 2; ++axis) {  // Klipper: the words' coordinates
    from[axis] = klipper ? at_[axis] - base_[axis] : at_[axis];
    to[axis] = klipper ? number(kAxes[axis]).value_or(from[axis]) : target.at[axis];
  }
  const double dx = to[0] - from[0];
  const double dy = to[1] - from[1];
  double i = length_mm("I").value_or(0.0);
  double j = length_mm("J").value_or(0.0);
  if (const std::optional<double> radius = length_mm("R")) {
    const double chord = std::hypot(dx, dy);
    const double square = *radius * *radius - chord * chord / 4.0;
    if (chord == 0.0 || *radius == 0.0 ||
        (is(Firmware::rrf) && square < -0.02 * *radius * *radius)) {
      throw Refused{};
    }
    const double side = clockwise == (*radius < 0.0) ? 1.0 : -1.0;
    const double height = side * std::sqrt(std::max(0.0, square)) / chord;
    i = dx / 2.0 - dy * height;
    j = dy / 2.0 + dx * height;
  }
  if (i == 0.0 && j == 0.0) {
    throw Refused{};
  }
  const std::array<double, 2> end = {to[0] - (from[0] + i), to[1] - (from[1] + j)};  // from centre
  double angle = std::atan2(j * end[0] - i * end[1], -i * end[0] - j * end[1]);
  const double near_mm = marlin ? 1e-6 : 0.0;
  const bool closed = std::abs(dx) <= near_mm && std::abs(dy) <= near_mm;
  if (closed) {
    // Because of rounding, Klipper leaves out some full circles.
    angle = clockwise ? -kTurn : kTurn;
  } else if (klipper) {
    angle += (angle < 0.0 ? kTurn : 0.0) - (clockwise ? kTurn : 0.0);
  } else if (angle == 0.0 && marlin) {
    return;  // straight to the centre or away from it: dropped, E and all
  } else if (clockwise ? angle > 0.0 : angle < 0.0) {
    angle += clockwise ? -kTurn : kTurn;
  }
  take_feed();
  const double steps = std::max(1.0, std::ceil(std::abs(angle) * 360.0 / kTurn));
  for (double step = 1.0; step < steps; ++step) {
    const double cosine = std::cos(angle * step / steps);
    const double sine = std::sin(angle * step / steps);
    path_.push_back({at_[0] + shift_mm_[0] + i - i * cosine + j * sine,
                     at_[1] + shift_mm_[1] + j - i * sine - j * cosine,
                     at_[2] + shift_mm_[2] + (target.at[2] - at_[2]) * step / steps});
  }
  go_to(target);
}

// firmware_retraction.py, cmd_G10: a relative G1 between SAVE_GCODE_STATE and RESTORE_GCODE_STATE,
// so the flow factor counts and the reading stays. In Marlin (fwretract.cpp, retract()) the factor
// does not count, because motion.cpp, _internal_move_to_destination(), suspends it. It does not
// count in RepRapFirmware either (GCodes.cpp, RetractFilament()).
void TextMachine::retract(bool back, double length_mm) {
  if (std::exchange(reading_.retracted, back) == back) {
    return;
  }
  const double filament_mm = length_mm * (is(Firmware::klipper) ? reading_.flow_factor : 1.0);
  reading_.filament_mm += filament_mm;
  if (is(Firmware::klipper)) {
    at_[E] += filament_mm;
    base_[E] += filament_mm;
  }
}

// gcode_move.py, _handle_home_rails_end; motion.cpp, set_axis_is_at_home(); GCodes.cpp, DoHome().
void TextMachine::home() {
  for (std::size_t axis = 0; axis < E; ++axis) {
    if (has(kAxes[axis]) || !has_any_of("XYZ")) {
      at_[axis] = shift_mm_[axis] = 0.0;
      base_[axis] = homing_[axis];
      reading_.known[axis] = true;
    }
  }
}

// stepper_enable.py, cmd_M18, ignores all words. M17_M18_M84.cpp and GCodes2.cpp, HandleMcode(): S
// sets a timeout, and only the named axes stop.
void TextMachine::motors_off() {
  const bool all = is(Firmware::klipper) || !has_any_of("XYZES");
  for (std::size_t axis = 0; axis < E; ++axis) {
    const bool named = has(kAxes[axis]) && (is(Firmware::rrf) || !has("S"));
    reading_.known[axis] = reading_.known[axis] && !all && !named;
  }
}

// gcode.h, set_relative_mode(): Marlin forgets M82 and M83. The others do not (gcode_move.py,
// cmd_G90; GCodes2.cpp, HandleGcode()).
void TextMachine::set_relative(bool relative) {
  reading_.absolute_xyz = !relative;
  if (is(Firmware::marlin)) {
    absolute_e_words_ = !relative;
  }
}

// gcode_move.py, cmd_G20: Klipper refuses inches.
void TextMachine::use_inches() {
  if (is(Firmware::klipper)) {
    throw Refused{};
  }
  reading_.inches = true;
}

// gcode_move.py, cmd_G92: moves the base, that of E too, and the base of all axes if none is named.
void TextMachine::klipper_g92() {
  Coordinates base = has_any_of("XYZE") ? base_ : at_;
  for (std::size_t axis = 0; axis < kAxes.size(); ++axis) {
    if (const std::optional<double> word = number(kAxes[axis])) {
      base[axis] = at_[axis] - *word * (axis == E ? reading_.flow_factor : 1.0);
    }
  }
  base_ = base;
}

// G92.cpp: moves the workspace, and sets E.
void TextMachine::marlin_g92() {
  for (std::size_t axis = 0; axis < kAxes.size(); ++axis) {
    const double native = kept(length_mm(kAxes[axis]).value_or(0.0) + base_[axis]);
    const double moved = kept(native - at_[axis]);
    if (number(kAxes[axis]) && std::abs(moved) > 1e-6) {
      (axis == E ? at_[E] : base_[axis]) = axis == E ? native : kept(base_[axis] - moved);
    }
  }
}

// GCodes3.cpp, SetPositions(): sets the position, and the axis counts as homed.
void TextMachine::rrf_g92() {
  for (std::size_t axis = 0; axis < kAxes.size(); ++axis) {
    const double value = length_mm(kAxes[axis]).value_or(at_[axis]);
    if (axis != E && has(kAxes[axis])) {
      const bool was_known = std::exchange(reading_.known[axis], true);
      shift_mm_[axis] = was_known ? shift_mm_[axis] + at_[axis] - value : 0.0;
    }
    at_[axis] = value;
  }
}

// S of M220 and M221. Without S, Klipper takes 100 (gcode_move.py). Marlin takes whole numbers
// (M220.cpp, M221.cpp), RepRapFirmware nothing below 1 (GCodes2.cpp, HandleMcode()).
double TextMachine::percentage(double current) const {
  const std::optional<double> word = number("S");
  if (is(Firmware::marlin)) {
    return word ? kept(std::trunc(*word) * 0.01) : current;
  }
  if (word && (*word <= 0.0 || (is(Firmware::rrf) && *word < 1.0))) {
    throw Refused{};
  }
  return is(Firmware::klipper) ? word.value_or(100.0) / 100.0 : word ? kept(*word * 0.01) : current;
}

// gcode_move.py, cmd_M221: the base of E moves so that the reading stays.
void TextMachine::set_flow() {
  reading_.flow_factor = percentage(reading_.flow_factor);
  if (is(Firmware::klipper)) {
    base_[E] = at_[E] - reading_.e_reading_mm * reading_.flow_factor;
  }
}

// gcode_move.py, cmd_SAVE_GCODE_STATE.
void TextMachine::save_state() {
  saved_[has("NAME") ? line_.text("NAME") : "default"] = {reading_, absolute_e_words_, at_, base_,
                                                          homing_};
}

// gcode_move.py, cmd_RESTORE_GCODE_STATE: filament moved since the state was saved is not in the
// reading.
void TextMachine::restore_state() {
  const auto found = saved_.find(has("NAME") ? line_.text("NAME") : "default");
  if (found == saved_.end()) {
    throw Refused{};
  }
  const Saved& saved = found->second;
  reading_.absolute_xyz = saved.reading.absolute_xyz;
  reading_.feed_mm_s = saved.reading.feed_mm_s;
  reading_.speed_factor = saved.reading.speed_factor;
  reading_.flow_factor = saved.reading.flow_factor;
  absolute_e_words_ = saved.absolute_e_words;
  homing_ = saved.homing;
  base_ = saved.base;
  base_[E] += at_[E] - saved.at[E];
  if (number("MOVE").value_or(0.0) != 0.0) {
    go_to({{saved.at[0], saved.at[1], saved.at[2], at_[E]}, 0.0});
  }
}

// gcode_move.py, cmd_SET_GCODE_OFFSET.
void TextMachine::set_gcode_offset() {
  Goal moved{at_, 0.0};
  for (std::size_t axis = 0; axis < kAxes.size(); ++axis) {
    const std::string name(kAxes[axis]);
    const double adjusted = homing_[axis] + number(name + "_ADJUST").value_or(0.0);
    const double offset = number(name).value_or(adjusted);
    const double delta = offset - std::exchange(homing_[axis], offset);
    base_[axis] += delta;
    moved.at[axis] += delta;
  }
  if (number("MOVE").value_or(0.0) != 0.0) {
    moved.filament_mm = moved.at[E] - at_[E];
    go_to(moved);
  }
}

}  // namespace unflex::testing
