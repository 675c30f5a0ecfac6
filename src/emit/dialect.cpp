// Sources: Klipper docs/G-Codes.md (SET_VELOCITY_LIMIT). Marlin 2.1.2
// src/gcode/config/M200-M205.cpp (M203 in mm/s, M205 B in µs). RepRapFirmware 3.6
// src/GCodes/GCodes2.cpp and GCodes.cpp (M203 and M566 in mm/min).
#include "dialect.hpp"

#include <fmt/core.h>

#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "unflex/core/own_marks.hpp"

namespace unflex::emit {
namespace {

using planner::Limits;

constexpr std::string_view kKlipperLimits = "SET_VELOCITY_LIMIT";
constexpr double kMinute_s = 60.0;
constexpr double kMicroseconds = 1e6;

// NaN is unequal to any wanted limit, so the limit is written.
constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
constexpr std::array kUnknownAxes = {kUnknown, kUnknown, kUnknown, kUnknown};
constexpr Limits kUnknownLimits = {.max_velocity_mm_s = kUnknown,
                                   .max_accel_mm_s2 = kUnknown,
                                   .square_corner_velocity_mm_s = kUnknown,
                                   .minimum_cruise_ratio = kUnknown,
                                   .accel_to_decel_mm_s2 = kUnknown,
                                   .axis_max_velocity_mm_s = kUnknownAxes,
                                   .axis_max_accel_mm_s2 = kUnknownAxes,
                                   .axis_jerk_mm_s = kUnknownAxes,
                                   .print_accel_mm_s2 = kUnknown,
                                   .travel_accel_mm_s2 = kUnknown,
                                   .retract_accel_mm_s2 = kUnknown,
                                   .junction_deviation_mm = kUnknown,
                                   .min_velocity_mm_s = kUnknown,
                                   .min_travel_velocity_mm_s = kUnknown,
                                   .min_segment_time_s = kUnknown,
                                   .min_movement_velocity_mm_s = kUnknown,
                                   .jerk_policy = -1,
                                   .axis_max_jerk_mm_s = kUnknownAxes};

// One command, with only those of its words that have to be sent.
class CommandLine {
 public:
  explicit CommandLine(std::string_view command) : text_(command) {}

  // The value follows the name without anything between, as in X1000; the name may end in "=", as
  // in ACCEL=1000.
  void word(std::string_view name, double wanted, double current, double factor = 1.0) {
    if (wanted != current) {
      // Twelve digits: 0.1 · 60 is 6, not 6.000000000000001.
      text_ += fmt::format(" {}{:.12g}", name, wanted * factor);
      empty_ = false;
    }
  }

  void axes(const std::array<double, 4>& wanted, const std::array<double, 4>& current,
            double factor = 1.0) {
    constexpr std::array<std::string_view, 4> kNames = {"X", "Y", "Z", "E"};
    for (std::size_t axis = 0; axis < kNames.size(); ++axis) {
      word(kNames[axis], wanted[axis], current[axis], factor);
    }
  }

  void finish(std::vector<std::string>& lines) {
    if (!empty_) {
      lines.push_back(std::move(text_));
    }
  }

 private:
  std::string text_;
  bool empty_ = true;
};

void klipper(const Limits& wanted, const Limits& current, std::vector<std::string>& lines) {
  CommandLine line(kKlipperLimits);
  line.word("VELOCITY=", wanted.max_velocity_mm_s, current.max_velocity_mm_s);
  line.word("ACCEL=", wanted.max_accel_mm_s2, current.max_accel_mm_s2);
  line.word("SQUARE_CORNER_VELOCITY=", wanted.square_corner_velocity_mm_s,
            current.square_corner_velocity_mm_s);
  // Before March 2024 Klipper heeds ACCEL_TO_DECEL and does not know MINIMUM_CRUISE_RATIO. From
  // August 2025 on it ignores ACCEL_TO_DECEL. Between these dates ACCEL_TO_DECEL stands for a ratio
  // if no ratio is given (toolhead.py, cmd_SET_VELOCITY_LIMIT, commits 0105aa3 and 3ef760c), so we
  // always give a ratio with it.
  const bool to_decel = wanted.accel_to_decel_mm_s2 != current.accel_to_decel_mm_s2;
  line.word("MINIMUM_CRUISE_RATIO=", wanted.minimum_cruise_ratio,
            to_decel ? kUnknown : current.minimum_cruise_ratio);
  line.word("ACCEL_TO_DECEL=", wanted.accel_to_decel_mm_s2, current.accel_to_decel_mm_s2);
  line.finish(lines);
}

void marlin(const Limits& wanted, const Limits& current, bool classic_jerk,
            std::vector<std::string>& lines) {
  CommandLine accel("M201");
  accel.axes(wanted.axis_max_accel_mm_s2, current.axis_max_accel_mm_s2);
  accel.finish(lines);
  CommandLine velocity("M203");
  velocity.axes(wanted.axis_max_velocity_mm_s, current.axis_max_velocity_mm_s);
  velocity.finish(lines);
  CommandLine used("M204");
  used.word("P", wanted.print_accel_mm_s2, current.print_accel_mm_s2);
  used.word("R", wanted.retract_accel_mm_s2, current.retract_accel_mm_s2);
  used.word("T", wanted.travel_accel_mm_s2, current.travel_accel_mm_s2);
  used.finish(lines);
  CommandLine advanced("M205");
  if (classic_jerk) {
    advanced.axes(wanted.axis_jerk_mm_s, current.axis_jerk_mm_s);
  } else {
    advanced.word("J", wanted.junction_deviation_mm, current.junction_deviation_mm);
  }
  advanced.word("S", wanted.min_velocity_mm_s, current.min_velocity_mm_s);
  advanced.word("T", wanted.min_travel_velocity_mm_s, current.min_travel_velocity_mm_s);
  advanced.word("B", wanted.min_segment_time_s, current.min_segment_time_s, kMicroseconds);
  advanced.finish(lines);
}

// Where M205 sets a separate jerk for prints, M566 sets that one as well.
void rrf_jerks(const Limits& wanted, const Limits& current, bool has_print_jerk,
               std::vector<std::string>& lines) {
  CommandLine jerk("M566");
  jerk.axes(has_print_jerk ? wanted.axis_max_jerk_mm_s : wanted.axis_jerk_mm_s,
            has_print_jerk ? current.axis_max_jerk_mm_s : current.axis_jerk_mm_s, kMinute_s);
  jerk.word("P", wanted.jerk_policy, current.jerk_policy);
  jerk.finish(lines);
  if (has_print_jerk) {
    std::array<double, 4> now = current.axis_jerk_mm_s;
    for (std::size_t axis = 0; axis < now.size(); ++axis) {
      const double max = wanted.axis_max_jerk_mm_s[axis];
      now[axis] = max != current.axis_max_jerk_mm_s[axis] ? max : now[axis];
    }
    CommandLine print_jerk("M205");
    print_jerk.axes(wanted.axis_jerk_mm_s, now);
    print_jerk.finish(lines);
  }
}

void rrf(const Limits& wanted, const Limits& current, bool has_print_jerk,
         std::vector<std::string>& lines) {
  CommandLine accel("M201");
  accel.axes(wanted.axis_max_accel_mm_s2, current.axis_max_accel_mm_s2);
  accel.finish(lines);
  CommandLine velocity("M203");
  velocity.axes(wanted.axis_max_velocity_mm_s, current.axis_max_velocity_mm_s, kMinute_s);
  velocity.word("I", wanted.min_movement_velocity_mm_s, current.min_movement_velocity_mm_s,
                kMinute_s);
  velocity.finish(lines);
  CommandLine used("M204");
  used.word("P", wanted.print_accel_mm_s2, current.print_accel_mm_s2);
  used.word("T", wanted.travel_accel_mm_s2, current.travel_accel_mm_s2);
  used.finish(lines);
  rrf_jerks(wanted, current, has_print_jerk, lines);
}

// RepRapFirmware forgets the settings when it switches the shaper off, so they count only while it
// is on.
bool same_rrf_shaper(const gcode::Shaper& one, const gcode::Shaper& other) {
  return one.freq_x_hz == other.freq_x_hz &&
         (one.freq_x_hz == 0.0 || (one.settings.type_x == other.settings.type_x &&
                                   one.settings.damping_ratio_x == other.settings.damping_ratio_x &&
                                   one.settings.custom_words == other.settings.custom_words));
}

// RepRapFirmware has one shaper for both axes.
std::string rrf_shaper(const gcode::Shaper& wanted) {
  if (wanted.freq_x_hz == 0.0) {
    return "M593 P\"none\"";
  }
  const gcode::ShaperSettings& settings = wanted.settings;
  if (!settings.custom_words.empty()) {
    return "M593 " + settings.custom_words;
  }
  // "zvd" is what RepRapFirmware takes when it is told no type (AxisShaper::Configure).
  std::string line = fmt::format(
      "M593 P\"{}\" F{}", settings.type_x.empty() ? "zvd" : settings.type_x, wanted.freq_x_hz);
  if (settings.damping_ratio_x) {
    line += fmt::format(" S{}", *settings.damping_ratio_x);
  }
  return line;
}

}  // namespace

std::string_view brand(Firmware firmware) {
  switch (firmware) {
    case Firmware::marlin:
      return "Marlin";
    case Firmware::rrf:
      return "RepRapFirmware";
    case Firmware::klipper:
      break;
  }
  return "Klipper";
}

Limits raised(Limits in_run, double accel_mm_s2) {
  double& x = in_run.axis_max_accel_mm_s2[gcode::X];
  double& y = in_run.axis_max_accel_mm_s2[gcode::Y];
  double& e = in_run.axis_max_accel_mm_s2[gcode::E];
  for (double* limit : {&x, &y, &e, &in_run.print_accel_mm_s2, &in_run.travel_accel_mm_s2,
                        &in_run.max_accel_mm_s2, &in_run.accel_to_decel_mm_s2}) {
    *limit = std::max(*limit, accel_mm_s2);
  }
  return in_run;
}

Limits limits_in_run(Firmware firmware, const Limits& file, Limits raised) {
  if (firmware != Firmware::klipper) {
    raised.axis_max_velocity_mm_s[gcode::Z] = file.axis_max_velocity_mm_s[gcode::Z];
    raised.axis_max_velocity_mm_s[gcode::E] = file.axis_max_velocity_mm_s[gcode::E];
    raised.axis_max_accel_mm_s2[gcode::Z] = file.axis_max_accel_mm_s2[gcode::Z];
    raised.axis_jerk_mm_s[gcode::Z] = file.axis_jerk_mm_s[gcode::Z];
    raised.axis_max_jerk_mm_s[gcode::Z] = file.axis_max_jerk_mm_s[gcode::Z];
    raised.retract_accel_mm_s2 = file.retract_accel_mm_s2;
  }
  return raised;
}

ZLimits z_limits(const planner::FirmwareConfig& config, const Limits& in_run) {
  if (config.firmware == Firmware::klipper) {
    return {config.max_z_velocity_mm_s, config.max_z_accel_mm_s2};
  }
  constexpr double kOfJerk = 0.5;
  return {kOfJerk * in_run.axis_jerk_mm_s[gcode::Z], in_run.axis_max_accel_mm_s2[gcode::Z]};
}

Limits unknown_to_run(Firmware firmware, const Limits& file) {
  return limits_in_run(firmware, file, kUnknownLimits);
}

bool limits_act_early(Firmware firmware) { return firmware == Firmware::rrf; }

bool scales_whole_steps_of_e(Firmware firmware) { return firmware == Firmware::marlin; }

std::vector<std::string> limit_lines(const planner::FirmwareConfig& config, const Limits& wanted,
                                     const Limits& current) {
  std::vector<std::string> lines;
  switch (config.firmware) {
    case Firmware::klipper:
      klipper(wanted, current, lines);
      break;
    case Firmware::marlin:
      marlin(wanted, current, config.classic_jerk, lines);
      break;
    case Firmware::rrf:
      rrf(wanted, current, config.has_print_jerk, lines);
      break;
  }
  return lines;
}

std::string unless_interrupted(std::string line) {
  return line.replace(0, kKlipperLimits.size(), kLimitsMacro);
}

std::vector<std::string> shaper_lines(Firmware firmware, const gcode::Shaper& wanted,
                                      const gcode::Shaper& current) {
  std::vector<std::string> lines;
  // What is not known cannot be set.
  const bool x_is_other = firmware == Firmware::rrf || wanted.freq_x_hz != current.freq_x_hz;
  const bool x = !wanted.unknown_x && (current.unknown_x || x_is_other);
  const bool y = !wanted.unknown_y && (current.unknown_y || wanted.freq_y_hz != current.freq_y_hz);
  switch (firmware) {
    case Firmware::klipper:
      if (x || y) {
        lines.push_back("SET_INPUT_SHAPER" +
                        (x ? fmt::format(" SHAPER_FREQ_X={}", wanted.freq_x_hz) : "") +
                        (y ? fmt::format(" SHAPER_FREQ_Y={}", wanted.freq_y_hz) : ""));
      }
      break;
    case Firmware::marlin:
      if (x) {
        lines.push_back(fmt::format("M593 X F{}", wanted.freq_x_hz));
      }
      if (y) {
        lines.push_back(fmt::format("M593 Y F{}", wanted.freq_y_hz));
      }
      break;
    case Firmware::rrf:
      if (x && (current.unknown_x || !same_rrf_shaper(wanted, current))) {
        lines.push_back(rrf_shaper(wanted));
      }
      break;
  }
  return lines;
}

std::string advance_line(Firmware firmware, const gcode::PressureAdvance& wanted) {
  const double advance_s = wanted.advance_s.value();
  switch (firmware) {
    case Firmware::marlin:
      return fmt::format("M900 K{}", advance_s);
    case Firmware::rrf:
      return fmt::format("M572 D0 S{}", advance_s);
    case Firmware::klipper:
      break;
  }
  return fmt::format("SET_PRESSURE_ADVANCE{}{} ADVANCE={}{}",
                     wanted.extruder.empty() ? "" : " EXTRUDER=", wanted.extruder, advance_s,
                     wanted.smooth_s ? fmt::format(" SMOOTH_TIME={}", *wanted.smooth_s) : "");
}

std::string unknown_shaper_lines(Firmware firmware, const gcode::Shaper& wanted,
                                 const gcode::Shaper& current) {
  const bool x = wanted.unknown_x && !current.unknown_x;
  const bool y = wanted.unknown_y && !current.unknown_y;
  if (!x && !y) {
    return "";
  }
  switch (firmware) {
    case Firmware::klipper:
      return fmt::format("SET_INPUT_SHAPER{}{}", x ? " SHAPER_FREQ_X=..." : "",
                         y ? " SHAPER_FREQ_Y=..." : "");
    case Firmware::marlin:
      return fmt::format("{}{}{}", x ? "M593 X F..." : "", x && y ? " and " : "",
                         y ? "M593 Y F..." : "");
    case Firmware::rrf:
      break;
  }
  return "M593 P\"...\" F...";
}

}  // namespace unflex::emit
