#include "command_reader.hpp"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <vector>

#include "unflex/core/firmware_spec.hpp"

namespace unflex::machine {
namespace {

gcode::InterpreterOptions options_of(Firmware firmware) {
  gcode::InterpreterOptions options = gcode::default_options(firmware);
  options.firmware_retraction = true;
  // Before 3.6 there is only one jerk. Settings::print_jerk_mm_s() takes care of that.
  options.has_print_jerk = spec_of(firmware).motion.has_two_jerks;
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
    case 350:
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

}  // namespace

bool is_one_of(int number, std::initializer_list<int> numbers) {
  return std::ranges::find(numbers, number) != numbers.end();
}

char letter_of(std::size_t axis) {
  return static_cast<char>(std::toupper(static_cast<unsigned char>(kAxes[axis].front())));
}

CommandReader::CommandReader(Firmware firmware, std::string file)
    : file_(std::move(file)), interpreter_(options_of(firmware)) {
  reading.add("printer.firmware", std::string(to_string(firmware)), {file_, 0});
}

bool CommandReader::take(const std::string& text, const gcode::Command& command,
                         const SourcePlace& place) {
  const gcode::Event event = interpreter_.interpret({text, place.line});
  if (event.position_lost) {
    not_taken(text, command, place);
    return false;
  }
  // Steps and inches are a reason to warn only in a print.
  if (command.number != 92 && command.letter != 'G') {
    for (const std::string& warning : event.warnings) {
      reading.note(place, warning);
    }
  }
  constexpr std::string_view kJerk = "limits.jerk_";
  const bool is_print_jerk = interpreter_.options().has_print_jerk && command.number == 205;
  for (const LimitValue& limit : limit_values(*event.limits)) {
    reading.add(is_print_jerk ? "limits.print_jerk_" + limit.key.substr(kJerk.size()) : limit.key,
                as_written(limit.value), place);
    remember(limit, place);
    if (command.number == 566 && limit.key.starts_with(kJerk)) {
      reading.forget("limits.print_jerk_" + limit.key.substr(kJerk.size()));
    }
  }
  if (command.number == 200 && command.value('D').value_or(0.0) > 0.0) {
    reading.add("extruder.filament_diameter_mm", *command.value('D'), place);
  } else if (command.number == 207 || command.number == 208) {
    retraction(place);
  }
  return true;
}

void CommandReader::finish() {
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

void CommandReader::shaper(const std::string& axis, double freq_hz,
                           std::optional<double> damping_ratio, const SourcePlace& place) {
  reading.add("printer.input_shaper_freq_" + axis + "_hz", freq_hz, place);
  if (freq_hz > 0.0) {
    reading.add("dynamics." + axis + ".freq_hz", freq_hz, place);
    if (damping_ratio) {
      reading.add("printer.input_shaper_damping_ratio_" + axis, *damping_ratio, place);
      reading.add_shaper_damping(axis, *damping_ratio, place);
    }
  }
}

void CommandReader::not_taken(const std::string& text, const gcode::Command& command,
                              const SourcePlace& place) {
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

void CommandReader::remember(const LimitValue& limit, const SourcePlace& place) {
  for (std::size_t axis = 0; axis < velocity_.size(); ++axis) {
    if (limit.key == fmt::format("limits.max_{}_velocity_mm_s", kAxes[axis])) {
      velocity_[axis] = {as_written(limit.value), place};
    } else if (limit.key == fmt::format("limits.max_{}_accel_mm_s2", kAxes[axis])) {
      accel_[axis] = {as_written(limit.value), place};
    }
  }
}

void CommandReader::retraction(const SourcePlace& place) {
  const gcode::InterpreterOptions& o = interpreter_.options();
  reading.add("printer.firmware_retraction", true, place);
  reading.add("printer.retract_length_mm", o.retract_length_mm, place);
  reading.add("printer.retract_speed_mm_s", o.retract_speed_mm_s, place);
  reading.add("printer.unretract_extra_length_mm", o.unretract_extra_length_mm, place);
  reading.add("printer.unretract_speed_mm_s", o.unretract_speed_mm_s, place);
  reading.add("printer.retract_z_hop_mm", o.retract_z_hop_mm, place);
}

}  // namespace unflex::machine
