// Source: RepRapFirmware 3.6 src/GCodes/GCodes2.cpp and GCodes.cpp (M203 and M566 in mm/min).
#include <fmt/core.h>

#include <string>
#include <vector>

#include "command_line.hpp"
#include "firmware_dialect.hpp"
#include "unflex/core/firmware_spec.hpp"

namespace unflex::firmware::rrf {
namespace {

using emit::CommandLine;
using emit::RunLimits;
using emit::ShaperAxes;
using gcode::Shaper;
using planner::FirmwareConfig;
using planner::Limits;

constexpr double kMinute_s = 60.0;

// Where M205 sets a separate jerk for prints, M566 sets that one as well.
void jerk_lines(const Limits& wanted, const Limits& current, bool has_print_jerk,
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

void limit_lines(const FirmwareConfig& config, const Limits& wanted, const Limits& current,
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
  jerk_lines(wanted, current, config.has_print_jerk, lines);
}

void set_run_limits(const FirmwareConfig& config, const RunLimits& run, Limits& limits) {
  limits.jerk_policy = 1;
  limits.min_movement_velocity_mm_s = 0.01;  // AbsoluteMinFeedrate
  for (const gcode::Axis axis : {gcode::X, gcode::Y, gcode::E}) {
    limits.axis_max_jerk_mm_s[axis] =
        config.has_print_jerk ? run.corner_velocity_mm_s : planner::kNoLimit;
  }
  emit::set_axis_limits(run, limits);
}

// RepRapFirmware forgets the settings when it switches the shaper off, so they count only while it
// is on.
bool same_shaper(const Shaper& one, const Shaper& other) {
  return one.freq_hz.x == other.freq_hz.x &&
         (one.freq_hz.x == 0.0 || (one.settings.type.x == other.settings.type.x &&
                                   one.settings.damping_ratio.x == other.settings.damping_ratio.x &&
                                   one.settings.custom_words == other.settings.custom_words));
}

// RepRapFirmware has one shaper for both axes.
std::string shaper_line(const Shaper& wanted) {
  if (wanted.freq_hz.x == 0.0) {
    return "M593 P\"none\"";
  }
  const gcode::ShaperSettings& settings = wanted.settings;
  if (!settings.custom_words.empty()) {
    return "M593 " + settings.custom_words;
  }
  std::string line = fmt::format(
      "M593 P\"{}\" F{}", settings.type.x.empty() ? kSpec.filters.shaper_type : settings.type.x,
      wanted.freq_hz.x);
  if (settings.damping_ratio.x) {
    line += fmt::format(" S{}", *settings.damping_ratio.x);
  }
  return line;
}

void shaper_lines(const Shaper& wanted, const Shaper& current, ShaperAxes axes,
                  std::vector<std::string>& lines) {
  if (axes.x && (current.unknown.x || !same_shaper(wanted, current))) {
    lines.push_back(shaper_line(wanted));
  }
}

std::string unknown_shaper_lines(ShaperAxes /*axes*/) { return "M593 P\"...\" F..."; }

}  // namespace

extern constexpr emit::FirmwareDialect kDialect = {.limit_lines = limit_lines,
                                                   .set_run_limits = set_run_limits,
                                                   .shaper_lines = shaper_lines,
                                                   .unknown_shaper_lines = unknown_shaper_lines};

}  // namespace unflex::firmware::rrf
