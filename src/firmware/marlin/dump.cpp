// Marlin 2.1.2 src/gcode, *_report; src/module/settings.cpp. Marlin 1.0:
// Marlin/ConfigurationStore.cpp, Config_PrintSettings.
#include <fmt/core.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "command_reader.hpp"
#include "marlin_dump.hpp"
#include "text_lines.hpp"

namespace unflex::machine {
namespace {

void steps(CommandReader& reader, const SourcePlace& place) {
  for (std::size_t axis = 0; axis < kAxes.size(); ++axis) {
    if (const auto value = reader.state().steps_per_mm[axis]) {
      reader.reading.add(fmt::format("printer.{}_steps_per_mm", kAxes[axis]), *value, place);
    }
  }
}

void marlin_junctions(CommandReader& reader, const gcode::Command& command,
                      const SourcePlace& place) {
  // Marlin lists the one it was built with: junction deviation (J) or classic jerk (X).
  if (command.has('J')) {
    reader.reading.add("printer.classic_jerk", false, place);
    // M503 shows only two decimals of J.
    if (command.value('J') == 0.01 && reader.state().unit_mm == 1.0) {
      reader.reading.note(place,
                          "M503 rounds J, and Marlin's default of 0.013 shows as 0.01; if it was "
                          "never changed give --set limits.junction_deviation_mm=0.013",
                          {"limits.junction_deviation_mm"});
    }
  } else if (command.has('X')) {
    reader.reading.add("printer.classic_jerk", true, place);
  }
}

void marlin_shaper(CommandReader& reader, const gcode::Command& command, const SourcePlace& place) {
  if (command.has('X') || !command.has('Y')) {
    reader.shaper("x", reader.state().shaper.freq_hz.x,
                  reader.state().shaper.settings.damping_ratio.x, place);
  }
  if (command.has('Y') || !command.has('X')) {
    reader.shaper("y", reader.state().shaper.freq_hz.y,
                  reader.state().shaper.settings.damping_ratio.y, place);
  }
}

// A listing in the words of Marlin 1.0, said in today's words. There M204 has S for all motion
// with X, Y or Z and T for retraction, where today T is travel. M205 X is of X and Y together up to
// the first versions of 1.1.
std::string in_todays_words(const gcode::Command& command, std::string text) {
  if (command.is('M', 204) && command.has('S') && !command.has('P')) {
    const std::optional<double> accel = command.value('S');
    const std::optional<double> retract = command.value('T');
    return accel ? fmt::format("M204 P{0} T{0}", *accel) +
                       (retract ? fmt::format(" R{}", *retract) : "")
                 : text;
  }
  if (command.is('M', 205) && command.value('X') && !command.has('Y')) {
    text += fmt::format(" Y{}", *command.value('X'));
  }
  return text;
}

// M503 lists M665 only for deltas and SCARAs. It does not tell whether the machine is a CoreXY or
// the like.
Status read_marlin_line(CommandReader& reader, std::string_view line, std::size_t number) {
  constexpr std::string_view kEcho = "echo:";
  const std::size_t echo = line.rfind(kEcho);
  const std::string listed(
      trimmed(echo == std::string_view::npos ? line : line.substr(echo + kEcho.size())));
  const gcode::Command as_listed = gcode::parse(listed);
  const std::string text = in_todays_words(as_listed, listed);
  const gcode::Command command = gcode::parse(text);
  const SourcePlace place{reader.file(), number};
  const bool is_g_unit = command.is('G', 20) || command.is('G', 21);
  if (!is_g_unit && (command.kind != gcode::CommandKind::traditional || command.letter != 'M')) {
    return {};
  }
  if (is_g_unit || is_one_of(command.number, {92, 200, 201, 203, 204, 205, 207, 208, 593})) {
    reader.take(text, command, place);
  }
  if (as_listed.is('M', 204) && text != listed) {
    reader.reading.add("printer.variant", "marlin_1_0", place);
  }
  if (command.number == 92) {
    steps(reader, place);
  } else if (command.number == 493 && command.value('S')) {
    reader.reading.add("printer.ft_motion", *command.value('S') != 0.0, place);
  } else if (command.number == 900 && command.value('K')) {
    reader.reading.add("printer.linear_advance_s", std::max(0.0, *command.value('K')), place);
  } else if (command.number == 205) {
    marlin_junctions(reader, command, place);
  } else if (command.number == 593) {
    marlin_shaper(reader, command, place);
  } else if (command.number == 665) {
    return fail(ErrorKind::usage, place,
                fmt::format("M665 is of a delta or a SCARA, which {}", kNotSupported));
  }
  return {};
}

}  // namespace

Result<Reading> read_marlin_dump(std::string_view text, const std::string& file) {
  CommandReader reader(Firmware::marlin, file);
  // A feature that the dump does not list was not built in.
  reader.reading.add("printer.firmware_retraction", false, {file, 0});
  reader.reading.add("printer.input_shaper_freq_x_hz", 0.0, {file, 0});
  reader.reading.add("printer.input_shaper_freq_y_hz", 0.0, {file, 0});
  Status status;
  for_each_line(text, 1, [&](std::string_view line, std::size_t number) {
    if (status) {
      status = read_marlin_line(reader, line, number);
    }
  });
  if (!status) {
    return tl::unexpected(status.error());
  }
  reader.finish();
  return std::move(reader.reading);
}

}  // namespace unflex::machine
