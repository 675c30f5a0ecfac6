#include "unsafe_commands.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <string_view>

namespace unflex::flow {
namespace {

// What each firmware's documentation has for levelling a bed by its surface or by its screws:
//   G29 to G35, M420 421 (Marlin); M374 375 376 557 (RepRapFirmware).
constexpr std::array kLevellingG = {29, 30, 32, 33, 34, 35};
constexpr std::array kLevellingM = {374, 375, 376, 420, 421, 557};
constexpr std::array<std::string_view, 8> kLevellingNames = {
    "AXIS_TWIST", "BED_MESH",  "BED_SCREWS",   "BED_TILT",
    "DELTA_CAL",  "QUAD_GANT", "SCREWS_TILT_", "Z_TILT"};

// What moves or turns the firmware's axes against the motors: 206 428 home offsets, 290 babysteps,
// 556 skew and 579 scale (RepRapFirmware), 852 skew (Marlin), 665 666 667 669 kinematics.
constexpr std::array kShiftingM = {206, 290, 428, 556, 579, 665, 666, 667, 669, 852};
constexpr std::array<std::string_view, 4> kShiftingNames = {"SET_GCODE_OFFSET", "SET_SKEW",
                                                            "SKEW_PROFILE", "Z_THERMAL_ADJUST"};

template <class Codes>
bool has(const Codes& codes, int number) {
  return std::ranges::find(codes, number) != codes.end();
}

template <class Names>
bool begins_as_one_of(const Names& names, std::string_view name) {
  return std::ranges::any_of(names, [&](std::string_view each) { return name.starts_with(each); });
}

bool is_of(const gcode::Command& command, char letter) {
  return command.kind == gcode::CommandKind::traditional && command.letter == letter;
}

bool levels(const gcode::Command& command) {
  return (is_of(command, 'G') && has(kLevellingG, command.number)) ||
         (is_of(command, 'M') && has(kLevellingM, command.number)) ||
         (command.kind == gcode::CommandKind::extended &&
          begins_as_one_of(kLevellingNames, command.name));
}

bool shifts(const gcode::Command& command) {
  return (is_of(command, 'M') && has(kShiftingM, command.number)) ||
         (command.kind == gcode::CommandKind::extended &&
          begins_as_one_of(kShiftingNames, command.name));
}

}  // namespace

std::string name_of(const gcode::Command& command) {
  if (command.kind == gcode::CommandKind::extended) {
    return command.name;
  }
  if (command.kind != gcode::CommandKind::traditional) {
    return "this line";
  }
  const std::string name = fmt::format("{}{}", command.letter, command.number);
  return command.subnumber >= 0 ? fmt::format("{}.{}", name, command.subnumber) : name;
}

std::optional<std::string> why_unsafe(const gcode::Command& command) {
  if (levels(command)) {
    return fmt::format(
        "{} is for the firmware's bed levelling, which would bend the motion of a joint; take it "
        "out of the slicer's start code, and level the bed itself",
        name_of(command));
  }
  if (shifts(command)) {
    return fmt::format(
        "{} shifts or turns the firmware's axes, which are joints here; take it out of the "
        "slicer's start code, and correct kinematics.offset_mm or the rows instead",
        name_of(command));
  }
  if (command.is('G', 92) && (command.has_any("XYZ") || command.words.empty())) {
    return "G92 moves the zero of X, Y or Z, which are joints here; take it out, and home with G28";
  }
  if (command.is('G', 20)) {
    return "G20 makes inches of all lengths; slice in mm";
  }
  if (command.is('G', 93)) {
    return "G93 makes times of all speeds; take it out";
  }
  return std::nullopt;
}

bool limits_joints(const gcode::Command& command) {
  constexpr std::array kLimits = {201, 203, 205, 208, 566};
  return is_of(command, 'M') && has(kLimits, command.number) && command.has_any("XYZ");
}

}  // namespace unflex::flow
