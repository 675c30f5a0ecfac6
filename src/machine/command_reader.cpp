// Each command means what it means in a print, so the interpreter reads it.
//   Marlin 2.1.2 src/gcode, *_report; src/module/settings.cpp.
//   RepRapFirmware 3.6 src/GCodes, Movement/Kinematics/Kinematics.h (KinematicsType).
#include "command_reader.hpp"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "rrf_heaters.hpp"
#include "text_lines.hpp"
#include "unflex/core/number.hpp"
#include "unflex/gcode/command.hpp"
#include "unflex/gcode/interpreter.hpp"
#include "unflex/machine/limit_keys.hpp"

namespace unflex::machine {
namespace {

constexpr std::array kAxes = {"x", "y", "z", "e"};
constexpr std::string_view kInNumbers = "0123456789.+-";
constexpr std::string_view kNotSupported =
    "unflex does not support yet; print the sliced file as it is on it";

bool is_one_of(int number, std::initializer_list<int> numbers) {
  return std::ranges::find(numbers, number) != numbers.end();
}

// "E400:400" names several drives of which the first one counts here.
std::string firsts_of_lists(std::string_view line) {
  std::string text;
  bool skips = false;
  for (const char c : line) {
    skips = c == ':' || (skips && c != ' ' && c != '\t' && c != ';');
    if (!skips) {
      text.push_back(c);
    }
  }
  return text;
}

gcode::InterpreterOptions options_of(Firmware firmware) {
  gcode::InterpreterOptions options = gcode::default_options(firmware);
  options.firmware_retraction = true;
  // Before 3.6 there is only one jerk. Settings::print_jerk_mm_s() takes care of that.
  options.has_print_jerk = firmware == Firmware::rrf;
  return options;
}

// The keys that a line would set.
std::vector<std::string> keys_of(const gcode::Command& command) {
  std::vector<std::string> keys;
  const auto add_axes = [&](std::string_view pattern) {
    for (const std::string_view axis : kAxes) {
      if (command.has(static_cast<char>(std::toupper(axis.front())))) {
        keys.push_back(fmt::format(fmt::runtime(pattern), axis));
      }
    }
  };
  const auto add = [&](char letter, std::string_view key) {
    if (command.has(letter)) {
      keys.emplace_back(key);
    }
  };
  switch (command.number) {
    case 92:
      add_axes("printer.{}_steps_per_mm");
      break;
    case 201:
      add_axes("limits.max_{}_accel_mm_s2");
      break;
    case 203:
      add_axes("limits.max_{}_velocity_mm_s");
      break;
    case 204:
      add('P', "limits.print_accel_mm_s2");
      add('T', "limits.travel_accel_mm_s2");
      break;
    case 205:
    case 566:
      add_axes("limits.jerk_{}_mm_s");
      break;
    case 593:
      keys = {"dynamics.x.freq_hz", "dynamics.y.freq_hz"};
      break;
    default:
      break;
  }
  return keys;
}

// What both dialects share.
class CommandReader {
 public:
  CommandReader(Firmware firmware, std::string file)
      : file_(std::move(file)), interpreter_(options_of(firmware)) {
    reading.add("printer.firmware", std::string(to_string(firmware)), {file_, 0});
  }

  // Has the interpreter read a line with its command. Takes what the line sets, or notes that it is
  // not taken.
  void take(const std::string& text, const gcode::Command& command, const SourcePlace& place) {
    const gcode::Event event = interpreter_.interpret({text, place.line});
    if (event.position_lost) {
      return not_taken(text, command, place);
    }
    // Steps and inches are a reason to warn only in a print.
    if (command.number != 92 && command.letter != 'G') {
      for (const std::string& warning : event.warnings) {
        reading.note(place, warning);
      }
    }
    constexpr std::string_view kJerk = "limits.jerk_";
    const bool is_print_jerk =
        interpreter_.options().firmware == Firmware::rrf && command.number == 205;
    for (const LimitValue& limit : limit_values(*event.limits)) {
      reading.add(is_print_jerk ? "limits.print_jerk_" + limit.key.substr(kJerk.size()) : limit.key,
                  limit.value, place);
      remember(limit, place);
      if (command.number == 566 && limit.key.starts_with(kJerk)) {
        reading.forget("limits.print_jerk_" + limit.key.substr(kJerk.size()));
      }
    }
    switch (command.number) {
      case 92:
        steps(place);
        break;
      case 200:
        if (command.value('D').value_or(0.0) > 0.0) {
          reading.add("extruder.filament_diameter_mm", *command.value('D'), place);
        }
        break;
      case 207:
      case 208:
        retraction(place);
        break;
      default:
        break;
    }
  }

  // Adds the tool's limits from those of X and Y. The motors' limits follow from them: velocity
  // enough for the faster axis, acceleration not too much for the weaker.
  void finish() {
    const auto& [x_velocity, y_velocity] = velocity_;
    const bool y_is_faster = y_velocity && (!x_velocity || y_velocity->first > x_velocity->first);
    if (const Found& faster = y_is_faster ? y_velocity : x_velocity) {
      reading.add("limits.max_velocity_mm_s", faster->first, faster->second);
    }
    const auto& [x_accel, y_accel] = accel_;
    const bool y_is_weaker = y_accel && (!x_accel || y_accel->first < x_accel->first);
    if (const Found& weaker = y_is_weaker ? y_accel : x_accel) {
      reading.add("limits.max_accel_mm_s2", weaker->first, weaker->second);
    }
  }

  // A shaper's frequency is the resonance as it was measured.
  void shaper(const std::string& axis, double freq_hz, std::optional<double> damping_ratio,
              const SourcePlace& place) {
    reading.add("printer.input_shaper_freq_" + axis + "_hz", freq_hz, place);
    if (freq_hz > 0.0) {
      reading.add("dynamics." + axis + ".freq_hz", freq_hz, place);
      if (damping_ratio) {
        reading.add("printer.input_shaper_damping_ratio_" + axis, *damping_ratio, place);
        reading.add("dynamics." + axis + ".damping_ratio", *damping_ratio, place);
      }
    }
  }

  [[nodiscard]] const gcode::ModalState& state() const { return interpreter_.state(); }
  [[nodiscard]] const std::string& file() const { return file_; }

  Reading reading;

 private:
  using Found = std::optional<std::pair<double, SourcePlace>>;

  void not_taken(const std::string& text, const gcode::Command& command, const SourcePlace& place) {
    const std::string_view why = text.find('{') != std::string::npos
                                     ? "an expression, which unflex does not evaluate"
                                     : "two commands, or a word given twice";
    const std::vector<std::string> keys = keys_of(command);
    reading.note(
        place,
        fmt::format("{}: nothing of this line is taken; {}", why,
                    keys.empty() ? "write values there"
                                 : fmt::format("give {} with --set", fmt::join(keys, " and "))),
        keys);
  }

  void remember(const LimitValue& limit, const SourcePlace& place) {
    for (std::size_t axis = 0; axis < velocity_.size(); ++axis) {
      if (limit.key == fmt::format("limits.max_{}_velocity_mm_s", kAxes[axis])) {
        velocity_[axis] = {limit.value, place};
      } else if (limit.key == fmt::format("limits.max_{}_accel_mm_s2", kAxes[axis])) {
        accel_[axis] = {limit.value, place};
      }
    }
  }

  void steps(const SourcePlace& place) {
    for (std::size_t axis = 0; axis < kAxes.size(); ++axis) {
      if (const auto value = state().steps_per_mm[axis]) {
        reading.add(fmt::format("printer.{}_steps_per_mm", kAxes[axis]), *value, place);
      }
    }
  }

  void retraction(const SourcePlace& place) {
    const gcode::InterpreterOptions& o = interpreter_.options();
    reading.add("printer.firmware_retraction", true, place);
    reading.add("printer.retract_length_mm", o.retract_length_mm, place);
    reading.add("printer.retract_speed_mm_s", o.retract_speed_mm_s, place);
    reading.add("printer.unretract_extra_length_mm", o.unretract_extra_length_mm, place);
    reading.add("printer.unretract_speed_mm_s", o.unretract_speed_mm_s, place);
    reading.add("printer.retract_z_hop_mm", o.retract_z_hop_mm, place);
  }

  std::string file_;
  gcode::Interpreter interpreter_;
  // The latest limits of X and of Y.
  std::array<Found, 2> velocity_;
  std::array<Found, 2> accel_;
};

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
    reader.shaper("x", reader.state().shaper_freq_x_hz, reader.state().shaper.damping_ratio_x,
                  place);
  }
  if (command.has('Y') || !command.has('X')) {
    reader.shaper("y", reader.state().shaper_freq_y_hz, reader.state().shaper.damping_ratio_y,
                  place);
  }
}

// M503 lists M665 only for deltas and SCARAs. It does not tell whether the machine is a CoreXY or
// the like.
Status read_marlin_line(CommandReader& reader, std::string_view line, std::size_t number) {
  constexpr std::string_view kEcho = "echo:";
  const std::size_t echo = line.rfind(kEcho);
  const std::string text(
      trimmed(echo == std::string_view::npos ? line : line.substr(echo + kEcho.size())));
  const gcode::Command command = gcode::parse(text);
  const SourcePlace place{reader.file(), number};
  const bool is_g_unit = command.is('G', 20) || command.is('G', 21);
  if (!is_g_unit && (command.kind != gcode::CommandKind::traditional || command.letter != 'M')) {
    return {};
  }
  if (is_g_unit || is_one_of(command.number, {92, 200, 201, 203, 204, 205, 207, 208, 593})) {
    reader.take(text, command, place);
  }
  if (command.number == 493 && command.value('S')) {
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

// The length of the value that the text begins with: a number, an expression in braces, or a text
// in quotes.
std::size_t value_length(std::string_view text) {
  int depth = 0;
  bool in_quotes = false;
  for (std::size_t at = 0; at < text.size(); ++at) {
    const char c = text[at];
    in_quotes = in_quotes != (c == '"');
    depth += in_quotes ? 0 : (c == '{') - (c == '}');
    const bool goes_on = in_quotes || depth > 0 || c == '"' || c == '}' ||
                         kInNumbers.find(c) != std::string_view::npos;
    if (!goes_on) {
      return at;
    }
  }
  return text.size();
}

// Each letter, in upper case, with the text of its value, or of its values if colons part them.
std::map<char, std::vector<std::string_view>> values_of(std::string_view arguments) {
  std::map<char, std::vector<std::string_view>> values;
  while (!arguments.empty()) {
    const auto letter = static_cast<char>(std::toupper(static_cast<unsigned char>(arguments[0])));
    arguments = trimmed(arguments.substr(1));
    values.erase(letter);
    for (bool is_value = letter >= 'A' && letter <= 'Z'; is_value;) {
      const std::size_t length = value_length(arguments);
      values[letter].push_back(arguments.substr(0, length));
      arguments.remove_prefix(length);
      is_value = arguments.starts_with(':');
      arguments.remove_prefix(is_value ? 1 : 0);
    }
  }
  return values;
}

// What M208 says of one end of an axis.
struct TravelEnd {
  std::optional<double> mm;
  SourcePlace place;
  bool is_outdated = false;  // a later line gave no number
};

struct Travel {
  TravelEnd min;
  TravelEnd max;
};

// Reads X0:220, or X0 with S1 for the minimum and X220 for the maximum.
void read_travel(CommandReader& reader, std::string_view arguments, std::array<Travel, 2>& travel,
                 const SourcePlace& place) {
  const std::map<char, std::vector<std::string_view>> values = values_of(arguments);
  const auto s = values.find('S');
  const bool is_min = s != values.end() && parse_number(s->second.front()) == 1.0;
  for (std::size_t axis = 0; axis < travel.size(); ++axis) {
    const char letter = static_cast<char>(std::toupper(kAxes[axis][0]));
    const auto given = values.find(letter);
    if (given == values.end()) {
      continue;
    }
    std::string_view why;
    const auto take = [&](TravelEnd& end, std::string_view text) {
      if (const std::optional<double> mm = parse_number(text)) {
        end = {mm, place};
      } else {
        end.is_outdated = true;
        why = text.starts_with('{') ? "an expression, which unflex does not evaluate" : "no number";
      }
    };
    const std::vector<std::string_view>& list = given->second;
    take(is_min || list.size() > 1 ? travel[axis].min : travel[axis].max, list.front());
    if (list.size() > 1) {
      take(travel[axis].max, list[1]);
    }
    if (!why.empty()) {
      const std::string key = fmt::format("printer.travel_{}_mm", kAxes[axis]);
      reader.reading.note(
          place, fmt::format("{}: {} is not taken; give {} with --set", why, letter, key), {key});
    }
  }
}

// Adds the travel of an axis. If one end is outdated, its place is taken. It is before the place of
// the note on that end, so the note is still told (load.cpp, is_known).
void add_travel(CommandReader& reader, const Travel& travel, std::string_view axis) {
  const auto& [min, max] = travel;
  if (!max.mm || (min.is_outdated && !min.mm)) {
    return;
  }
  const bool of_min = min.is_outdated || (!max.is_outdated && min.place.line > max.place.line);
  reader.reading.add(fmt::format("printer.travel_{}_mm", axis),
                     Range{min.mm.value_or(0.0), *max.mm}, of_min ? min.place : max.place);
}

Status read_rrf_kinematics(CommandReader& reader, const gcode::Command& command,
                           std::string_view arguments, const SourcePlace& place) {
  const auto refuse = [&](std::string message) {
    return fail(ErrorKind::usage, place, std::move(message));
  };
  if (command.number == 665) {
    return refuse(fmt::format("M665 makes this machine a delta, which {}", kNotSupported));
  }
  const std::map<char, std::vector<std::string_view>> values = values_of(arguments);
  if (values.contains('X') || values.contains('Y') || values.contains('Z')) {
    return refuse(
        "M669 gives a matrix of its own, which unflex does not read; give a printer file of "
        "unflex with the kinematics.type that it stands for (unflex printer init writes one)");
  }
  if (!values.contains('K')) {
    return {};
  }
  const std::optional<double> value = parse_number(values.at('K').front());
  if (!value) {
    reader.reading.note(
        place,
        "no number behind K: this line is not taken, since unflex does not evaluate "
        "expressions; give kinematics.type with --set",
        {"kinematics.type"});
    return {};
  }
  // KinematicsType.
  constexpr std::array kTypes = {std::pair{0, Kinematics::cartesian},
                                 std::pair{1, Kinematics::corexy}, std::pair{2, Kinematics::corexz},
                                 std::pair{11, Kinematics::hybrid_corexy}};
  const int number = to_int(*value);
  const auto* type = std::ranges::find(kTypes, number, &std::pair<int, Kinematics>::first);
  if (type == kTypes.end()) {
    return refuse(fmt::format("kinematics K{} is a machine that {}", number, kNotSupported));
  }
  reader.reading.add("kinematics.type", std::string(to_string(type->second)), place);
  return {};
}

void rrf_shaper(CommandReader& reader, const SourcePlace& place) {
  const gcode::ModalState& state = reader.state();
  constexpr double kDefaultDampingRatio = 0.1;  // AxisShaper.h
  if (state.shaper.type_x == "custom") {
    return reader.reading.note(
        place,
        "a custom shaper cannot be set back after the print; unflex leaves it to "
        "the file's own M593");
  }
  for (const std::string axis : {"x", "y"}) {
    reader.shaper(axis, state.shaper_freq_x_hz,
                  state.shaper.damping_ratio_x.value_or(kDefaultDampingRatio), place);
  }
  if (state.shaper_freq_x_hz > 0.0) {
    reader.reading.add("printer.input_shaper_type", state.shaper.type_x, place);
  }
}

Status read_rrf_line(CommandReader& reader, std::string_view line, std::size_t number,
                     std::array<Travel, 2>& travel, RrfHeaters& heaters) {
  const gcode::Command original = gcode::parse(line);
  const SourcePlace place{reader.file(), number};
  if (original.kind == gcode::CommandKind::none) {
    return {};
  }
  const std::string text = firsts_of_lists(line);
  const gcode::Command command = gcode::parse(text);
  if (command.kind != gcode::CommandKind::traditional || command.letter != 'M') {
    return {};
  }
  if (is_one_of(command.number, {92, 200, 201, 203, 204, 205, 207, 566, 593})) {
    reader.take(text, command, place);
  }
  heaters.read(command, place);
  switch (command.number) {
    case 82:
    case 83:
      // GCodes.cpp, CopyStateFrom after config.g: a print begins in that mode.
      reader.reading.add("printer.relative_extrusion", command.number == 83, place);
      break;
    case 98:
      reader.reading.note(place, "M98 runs another file, which unflex does not read");
      break;
    case 208:
      read_travel(reader, original.arguments, travel, place);
      break;
    case 593:
      rrf_shaper(reader, place);
      break;
    case 665:
    case 669:
      return read_rrf_kinematics(reader, command, original.arguments, place);
    default:
      break;
  }
  return {};
}

}  // namespace

Result<Reading> read_marlin_dump(std::string_view text, const std::string& file) {
  CommandReader reader(Firmware::marlin, file);
  // What the dump does not list was not built in.
  reader.reading.add("printer.firmware_retraction", false, {file, 0});
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

Result<Reading> read_rrf_config(std::string_view text, const std::string& file) {
  CommandReader reader(Firmware::rrf, file);
  std::array<Travel, 2> travel;
  RrfHeaters heaters;
  Status status;
  for_each_line(text, 1, [&](std::string_view line, std::size_t number) {
    if (status) {
      status = read_rrf_line(reader, line, number, travel, heaters);
    }
  });
  if (!status) {
    return tl::unexpected(status.error());
  }
  for (std::size_t axis = 0; axis < travel.size(); ++axis) {
    add_travel(reader, travel[axis], kAxes[axis]);
  }
  heaters.add_to(reader.reading);
  reader.finish();
  return std::move(reader.reading);
}

}  // namespace unflex::machine
