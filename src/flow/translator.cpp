#include "translator.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "unflex/core/number.hpp"
#include "unflex/core/own_marks.hpp"
#include "unflex/run/own_output.hpp"
#include "unsafe_commands.hpp"

namespace unflex::flow {
namespace {

using gcode::CommandKind;
using gcode::kXYZ;
using kinematics::Joints;
using kinematics::Point;

bool is_motion(const gcode::Command& command) {
  return command.kind == CommandKind::traditional && command.letter == 'G' && command.number >= 0 &&
         command.number <= 3;
}

void read(gcode::Interpreter& interpreter, std::string text) {
  gcode::Line line;
  line.text = std::move(text);
  static_cast<void>(interpreter.interpret(std::move(line)));
}

// Tells the interpreter where the machine is, and leaves its modes.
void put(gcode::Interpreter& interpreter, const Point& p) {
  const bool absolute_xyz = interpreter.state().absolute_xyz;
  const bool absolute_e = interpreter.state().absolute_e;
  read(interpreter, "G90");
  read(interpreter, fmt::format("G1 X{:.9f} Y{:.9f} Z{:.9f}", p[0], p[1], p[2]));
  read(interpreter, absolute_xyz ? "G90" : "G91");
  read(interpreter, absolute_e ? "M82" : "M83");
}

}  // namespace

Translator::Translator(TranslatorOptions options, std::string name)
    : options_(std::move(options)),
      name_(std::move(name)),
      sliced_(options_.interpreter),
      written_(options_.interpreter) {}

tl::unexpected<Error> Translator::wrong(std::string what) const {
  return fail(ErrorKind::input, {name_, event_.line.number}, std::move(what));
}

void Translator::finish(std::string& text) const {
  text += ends_with_newline_ ? "" : "\n";
  text += fmt::format("{} {} moves of the tool in {} lines\n", kJointsMark, moves_, lines_);
}

Status Translator::translate(const gcode::Line& line, std::string& text) {
  if (Status sliced = run::check_as_sliced(line, name_); !sliced) {
    return sliced;
  }
  const gcode::ModalState before = sliced_.state();
  event_.line = line;
  sliced_.interpret(event_);
  gcode::parse(event_.line.content(), command_);
  if (const auto why = why_unsafe(command_)) {
    return wrong(*why);
  }
  const std::size_t begin = text.size();
  if (Status carried = carry_over(before, text); !carried) {
    return carried;
  }
  for (const std::string& warning : event_.warnings) {
    warnings_.push_back({{name_, line.number}, warning});
  }
  warn_of_limits();
  read_back(std::string_view(text).substr(begin));
  keep_mode_of_e(text);
  ends_with_newline_ = text.ends_with('\n');
  return check();
}

Status Translator::carry_over(const gcode::ModalState& before, std::string& text) {
  if (command_.is('G', 28)) {
    return home(text);
  }
  const bool is_alone = event_.warnings.empty() && !command_.has_any("GM");
  if (is_alone && (command_.is('M', 18) || command_.is('M', 84))) {
    known_.fill(false);
    lost_by_ = fmt::format("M{} in line {}", command_.number, event_.line.number);
    needs_home_ = true;
    text += event_.line.text;
    return {};
  }
  if (is_alone && (event_.tool || (command_.is('M', 109) && event_.position_lost))) {
    return select_tool(text);
  }
  tells_feed_ = tells_feed_ || event_.kind == gcode::EventKind::border;
  if (event_.position_lost) {
    return is_motion(command_) || !event_.warnings.empty()
               ? wrong(fmt::format("this line is not understood{}{}; correct it, or take it out",
                                   event_.warnings.empty() ? "" : ": ",
                                   event_.warnings.empty() ? "" : event_.warnings.front()))
               : wrong(
                     fmt::format("{} may move the machine, and its moves would be of joints; "
                                 "write what it does into the slicer's own G-code, or take it out",
                                 name_of(command_)));
  }
  if (is_motion(command_)) {
    return motion(before, text);
  }
  if (moves_tool(event_)) {
    return wrong(
        fmt::format("{} moves the tool by the firmware's own rules, which would move a "
                    "joint; switch that off, as a hop of Z at retractions, in the slicer",
                    name_of(command_)));
  }
  const gcode::ModalState& after = sliced_.state();
  if (std::ranges::any_of(kXYZ, [&](gcode::Axis axis) { return after.base_mm[axis] != 0.0; })) {
    return wrong("this line moves the zero of X, Y or Z, which are joints here; take it out");
  }
  if (command_.is('G', 91) && command_.words.empty() && !command_.line_number) {
    text += with_command(event_.line, after.e_is_absolute() ? "M82" : "M83");
    return {};
  }
  text += event_.line.text;
  return {};
}

Status Translator::home(std::string& text) {
  const bool names_none = command_.words.empty();
  const bool names_all = command_.words.size() == known_.size() && command_.has('X') &&
                         command_.has('Y') && command_.has('Z');
  if (command_.subnumber >= 0 || !event_.warnings.empty() || !(names_none || names_all)) {
    return wrong(
        "G28 with words homes some of the joints alone, or in another way; write G28, which homes "
        "all");
  }
  if (const auto& home_mm = options_.home_mm) {
    if (const auto why = why_not_at(options_.machine, *home_mm)) {
      return wrong(
          fmt::format("kinematics.home_mm is where G28 leaves the tool, but {}; correct "
                      "the keys of kinematics",
                      *why));
    }
    const Result<Joints> q = to_joints(options_.machine, *home_mm);
    if (!q) {
      return wrong(q.error().message);
    }
    put(sliced_, *home_mm);
    joints_ = scaled_joints(*q);
  }
  known_.fill(options_.home_mm.has_value());
  lost_by_ = fmt::format("G28 in line {}", event_.line.number);
  needs_home_ = false;
  text += event_.line.text;
  return {};
}

// A printer of one tool does nothing when that is selected. RepRapFirmware's M109 selects it where
// none is in use.
Status Translator::select_tool(std::string& text) {
  const bool is_first = command_.letter == 'T'
                            ? event_.tool == 0
                            : command_.is('M', 109) && command_.value('T').value_or(0.0) == 0.0;
  if (!is_first) {
    return wrong(
        fmt::format("{} changes the tool, and the firmware's moves for that would be of "
                    "joints; slice for one tool",
                    name_of(command_)));
  }
  if (event_.position_lost) {
    known_.fill(false);
    lost_by_ = fmt::format("{} in line {}", name_of(command_), event_.line.number);
  }
  text += event_.line.text;
  return {};
}

void Translator::read_back(std::string_view written) {
  for (std::size_t at = 0; at < written.size();) {
    const std::size_t end = std::min(written.find('\n', at), written.size() - 1) + 1;
    read(written_, std::string(written.substr(at, end - at)));
    at = end;
  }
  if (command_.is('G', 28) && is_place_known()) {
    Point joints_mm{};
    std::ranges::transform(joints_, joints_mm.begin(), [](std::int64_t joint) {
      return static_cast<double>(joint) / power_of_ten(kJointDecimals);
    });
    put(written_, joints_mm);
  }
}

// G90 and G91 are modes of E, too, on some firmwares. The output has no G91.
void Translator::keep_mode_of_e(std::string& text) {
  const bool is_absolute = sliced_.state().e_is_absolute();
  if (is_absolute == written_.state().e_is_absolute()) {
    return;
  }
  const std::string_view ending =
      std::string_view(event_.line.text).substr(event_.line.content().size());
  text += ending.empty() ? "\n" : "";
  const std::string mode = is_absolute ? "M82" : "M83";
  text += mode;
  text += ending.empty() ? "\n" : ending;
  read(written_, mode);
}

void Translator::warn_of_limits() {
  if (told_of_limits_ || !limits_joints(command_)) {
    return;
  }
  told_of_limits_ = true;
  warnings_.push_back({{name_, event_.line.number},
                       fmt::format("{} limits X, Y and Z, which are joints here; let it give what "
                                   "the motors can do, or take it out",
                                   name_of(command_))});
}

Status Translator::check() const {
  constexpr double kNear_mm = 1e-3;
  const gcode::ModalState& state = written_.state();
  const gcode::ModalState& meant = sliced_.state();
  if (!state.absolute_xyz || state.unit_mm != 1.0 || state.inverse_time ||
      state.e_is_absolute() != meant.e_is_absolute()) {
    return wrong("this line sets modes that cannot be translated; write G91 in a line of its own");
  }
  bool is_meant = std::abs(state.position_mm[gcode::E] - meant.position_mm[gcode::E]) < kNear_mm;
  if (is_place_known()) {
    const Result<Joints> q = to_joints(options_.machine, place_of(meant.position_mm));
    for (std::size_t i = 0; i < known_.size(); ++i) {
      is_meant = is_meant && q && std::abs((*q)[i] - state.position_mm[i]) < kNear_mm;
    }
  }
  return is_meant ? Status{}
                  : Status(wrong("this line would be translated wrongly; take it out, and please "
                                 "report it"));
}

}  // namespace unflex::flow
