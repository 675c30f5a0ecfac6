#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <optional>
#include <sstream>
#include <string_view>
#include <vector>

#include "unflex/gcode/command.hpp"
#include "unflex/gcode/interpreter.hpp"
#include "unflex/gcode/layer_mark.hpp"
#include "unflex/gcode/line.hpp"
#include "unflex/tune/tower.hpp"

namespace unflex::tune {
namespace {

// Lines of one print that another has no use for: comments, progress, and objects that it has not.
bool is_of_this_print(const gcode::Command& command) {
  return command.kind == gcode::CommandKind::none || command.is('M', 73) || command.is('M', 486) ||
         command.name.starts_with("EXCLUDE_OBJECT");
}

// Moves, and what sets the place where the tool is. Homing stays: firmwares make room for it.
bool is_motion(const gcode::Command& command) {
  constexpr std::array kMoves = {0, 1, 2, 3, 10, 11, 92};
  return std::ranges::any_of(kMoves, [&](int number) { return command.is('G', number); });
}

struct Range {
  double min = 1e9;
  double max = -1e9;

  void add(double value) {
    min = std::min(min, value);
    max = std::max(max, value);
  }
  [[nodiscard]] double middle() const { return 0.5 * (min + max); }
};

}  // namespace

Result<Codes> codes_of(const std::string& print, const std::string& name, Firmware firmware) {
  std::istringstream stream(print);
  gcode::LineReader lines(stream, name);
  gcode::Interpreter interpreter(gcode::default_options(firmware));
  Codes codes;
  std::string behind;  // since the last move that lays filament
  bool laid = false;
  bool in_layers = false;
  Axes<Range> laid_mm;
  std::string before_first;  // the start code of a print without marks of layers
  for (gcode::Line line;;) {
    const Result<bool> more = lines.next(line);
    if (!more) {
      return tl::unexpected(more.error());
    }
    if (!*more) {
      break;
    }
    const std::string content(line.content());
    if (!in_layers && gcode::begins_layer(content)) {
      in_layers = true;
      // Filament laid before belongs to the start code.
      laid_mm = {};
      codes.start = before_first + behind;
      behind.clear();
      laid = false;
    }
    const gcode::Command command = gcode::parse(content);
    const gcode::Event event = interpreter.interpret(line);
    const bool extrudes = std::ranges::any_of(event.segments, &gcode::Segment::extruding);
    if (extrudes) {
      for (const gcode::Segment& segment : event.segments) {
        for_each_axis([](Range& range, double end_mm) { range.add(end_mm); }, laid_mm,
                      xy_of(segment.end_mm));
      }
      if (!in_layers && !laid) {
        codes.start = behind;
      }
      // A priming line ahead of the first layer's mark is part of the start code.
      before_first += in_layers ? std::string{} : behind + content + "\n";
      behind.clear();
      laid = true;
    } else if (!is_of_this_print(command) && !(in_layers && is_motion(command))) {
      behind += content + "\n";
    }
  }
  if (!laid) {
    return fail(ErrorKind::input, {name, 0},
                "lays no filament; give a sliced print, whose start code and temperatures the "
                "tower is to have");
  }
  codes.end = behind;
  codes.center_mm = map_axes([](const Range& range) { return range.middle(); }, laid_mm);
  return codes;
}

Codes plain_codes(double nozzle_temp_c, double bed_temp_c) {
  const std::string bed = bed_temp_c > 0.0 ? fmt::format("M140 S{:.0f}\n", bed_temp_c) : "";
  const std::string wait = bed_temp_c > 0.0 ? fmt::format("M190 S{:.0f}\n", bed_temp_c) : "";
  return {.start = bed + fmt::format("M104 S{0:.0f}\nG28\n{1}M109 S{0:.0f}\n", nozzle_temp_c, wait),
          .end = "M104 S0\nM140 S0\nM107\nM84\n"};
}

}  // namespace unflex::tune
