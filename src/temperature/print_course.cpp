#include "print_course.hpp"

#include <algorithm>
#include <array>
#include <deque>
#include <istream>
#include <limits>
#include <memory>
#include <optional>
#include <string_view>
#include <utility>

#include "unflex/core/firmware_spec.hpp"
#include "unflex/core/number.hpp"
#include "unflex/gcode/hotend_command.hpp"
#include "unflex/gcode/line.hpp"
#include "unflex/machine/as_printer.hpp"

namespace unflex::temperature {
namespace {

using hotend::Course;

// A move or a pause counts for no longer: by then the hotend rests, and the course stays short.
constexpr double kLongest_s = 3600.0;

bool is_indented(std::string_view content) {
  return content.starts_with(' ') || content.starts_with('\t');
}

// The temperature that a macro is told to print at, by the names that macros of many printers have.
std::optional<double> temperature_for_macro(const gcode::Command& command) {
  constexpr std::array kNames = {"EXTRUDER",  "EXTRUDER_TEMP", "EXTRUDER_TEMPERATURE",
                                 "HOTEND",    "HOTEND_TEMP",   "HOTEND_TEMPERATURE",
                                 "NOZZLE",    "NOZZLE_TEMP",   "NOZZLE_TEMPERATURE",
                                 "TOOL_TEMP", "PRINT_TEMP",    "T_EXTRUDER"};
  constexpr double kLeast_c = 150.0;
  for (const char* const name : kNames) {
    const auto value = parse_number(command.parameter(name).value_or(""));
    if (value && *value >= kLeast_c) {
      return value;
    }
  }
  return std::nullopt;
}

class CourseMaker {
 public:
  explicit CourseMaker(const machine::Settings& settings)
      : firmware_(settings.printer.firmware),
        filament_area_mm2_(settings.filament_area_mm2()),
        interpreter_(machine::interpreter_options(settings)),
        planner_(planner::make_planner(machine::planner_limits(settings),
                                       machine::firmware_config(settings))) {}

  void add(gcode::Line line) {
    // Most lines are such, and ask nothing of a hotend.
    if (!line.content().starts_with("G1 ")) {
      gcode::parse(line.content(), command_);
      watch(line);
    }
    gcode::Event event = interpreter_.interpret(std::move(line));
    if (event.position_lost) {
      watch_macro(event.line);
      awaited_.push_back({event.line.number, std::nullopt});
    }
    if (event.kind != gcode::EventKind::move) {
      planner_->apply(event);
    }
    for (const gcode::Segment& segment : event.segments) {
      planner_->add(segment);
    }
    if (event.kind == gcode::EventKind::barrier) {
      stop();
      now_s_ += std::min(event.dwell_s, kLongest_s);
    } else {
      play();
    }
  }

  PrintCourse finish() {
    stop();
    return std::move(result_);
  }

 private:
  // Something that takes effect when the moves of all lines before it have been played: a command
  // to the hotend, or else something that none may pass.
  struct Awaited {
    std::size_t line = 0;
    std::optional<hotend::Command> command;
  };

  void watch(const gcode::Line& line) {
    if (command_.kind == gcode::CommandKind::none) {
      return;
    }
    if (const auto tool = gcode::selected_tool(command_, firmware_)) {
      tool_ = *tool;
      awaited_.push_back({line.number, std::nullopt});
    }
    const auto asked = gcode::hotend_command(command_, firmware_);
    if (asked && asked->tool.value_or(tool_) == tool_) {
      awaited_.push_back({line.number, command_of(*asked, line)});
    } else if (gcode::pauses_print(command_) || is_in_block(line)) {
      awaited_.push_back({line.number, std::nullopt});
    }
  }

  // RepRapFirmware runs the indented lines behind `if` and `while` or does not, and no other line
  // may come among them.
  [[nodiscard]] bool is_in_block(const gcode::Line& line) const {
    return spec_of(firmware_).reading.has_blocks && is_indented(line.content());
  }

  [[nodiscard]] hotend::Command command_of(const gcode::HotendCommand& asked,
                                           const gcode::Line& line) const {
    hotend::Command command;
    command.line = line.number;
    command.target_c = asked.target_c;
    if (asked.waits) {
      command.wait = asked.waits_cooling ? hotend::Wait::settled : hotend::Wait::heating;
    }
    // A numbered line cannot leave its place, nor can one that says something else as well.
    const bool stands_alone = !command_.line_number && !command_.has_any("GM");
    if (!asked.target_c || is_in_block(line) || !stands_alone) {
      return command;
    }
    command.text = asked.waits ? gcode::set_hotend_line(*asked.target_c, asked.tool)
                               : std::string(line.content());
    command.text += line.text.ends_with("\r\n") ? "\r\n" : "\n";
    return command;
  }

  // A macro heats the hotend, too, if it begins the print.
  void watch_macro(const gcode::Line& line) {
    // The views of command_ point into a line, and that has been moved.
    gcode::parse(line.content(), command_);
    if (laid_mm3_ > 0.0 || command_.kind != gcode::CommandKind::extended) {
      return;
    }
    if (const std::optional<double> target_c = temperature_for_macro(command_)) {
      awaited_.push_back({line.number, hotend::Command{.line = line.number,
                                                       .target_c = target_c,
                                                       .wait = hotend::Wait::settled}});
    }
  }

  void stop() {
    planner_->stop();
    play();
    take_effect(std::numeric_limits<std::size_t>::max());
  }

  void play() {
    moves_.clear();
    planner_->take_played(moves_);
    for (const planner::PlannedMove& move : moves_) {
      take_effect(move.segment.line);
      play(move);
    }
  }

  // Lets what stands before a line take effect now.
  void take_effect(std::size_t before_line) {
    for (; !awaited_.empty() && awaited_.front().line < before_line; awaited_.pop_front()) {
      if (std::optional<hotend::Command>& command = awaited_.front().command) {
        command->time_s = now_s_;
        command->free_from_s = std::max(free_from_s_, first_extrusion_s_);
        command->laid_mm3 = laid_mm3_;
        result_.commands.push_back(std::move(*command));
      }
      free_from_s_ = now_s_;
    }
  }

  void play(const planner::PlannedMove& move) {
    const double begin_s = now_s_;
    const double duration_s = std::min(move.duration_s(), kLongest_s);
    now_s_ += duration_s;
    const std::size_t line = std::exchange(last_line_, move.segment.line);
    if (duration_s <= 0.0) {
      return;
    }
    const std::size_t first = index(begin_s);
    if (line != move.segment.line && step(first).first_line == 0) {
      step(first).first_line = static_cast<std::uint32_t>(move.segment.line);
    }
    if (!move.segment.extruding()) {
      return;
    }
    first_extrusion_s_ = std::min(first_extrusion_s_, begin_s);
    const double volume_mm3 = filament_area_mm2_ * move.segment.delta(gcode::E);
    laid_mm3_ += volume_mm3;
    for (std::size_t k = first; k <= index(now_s_); ++k) {
      const double from_s = std::max(begin_s, static_cast<double>(k) * Course::kStep_s);
      const double to_s = std::min(now_s_, static_cast<double>(k + 1) * Course::kStep_s);
      const double share_s = std::max(0.0, to_s - from_s);
      step(k).extruding_s += static_cast<float>(share_s);
      step(k).volume_mm3 += static_cast<float>(volume_mm3 * share_s / duration_s);
    }
  }

  static std::size_t index(double time_s) {
    return static_cast<std::size_t>(time_s / Course::kStep_s);
  }

  Course::Step& step(std::size_t k) {
    if (k >= result_.course.steps.size()) {
      result_.course.steps.resize(k + 1);
    }
    return result_.course.steps[k];
  }

  Firmware firmware_;
  double filament_area_mm2_;
  gcode::Interpreter interpreter_;
  std::unique_ptr<planner::Planner> planner_;
  std::vector<planner::PlannedMove> moves_;
  gcode::Command command_;
  std::deque<Awaited> awaited_;
  PrintCourse result_;
  int tool_ = 0;
  double now_s_ = 0.0;
  double laid_mm3_ = 0.0;
  double free_from_s_ = 0.0;
  double first_extrusion_s_ = std::numeric_limits<double>::infinity();
  std::size_t last_line_ = 0;
};

}  // namespace

Result<PrintCourse> print_course(const TextStore& text, const std::string& name,
                                 const machine::Settings& settings, Progress& progress) {
  constexpr std::size_t kLinesPerUpdate = 10000;
  const std::unique_ptr<std::istream> stream = text.read();
  if (!*stream) {
    return fail(ErrorKind::input, {name, 0}, "cannot read the file");
  }
  gcode::LineReader reader(*stream, name);
  CourseMaker maker(settings);
  for (;;) {
    gcode::Line line;
    const Result<bool> more = reader.next(line);
    if (!more) {
      return tl::unexpected(more.error());
    }
    if (!*more) {
      return maker.finish();
    }
    if (line.number % kLinesPerUpdate == 0 && progress.cancelled()) {
      return fail(ErrorKind::internal, "cancelled");
    }
    maker.add(std::move(line));
  }
}

}  // namespace unflex::temperature
