// Source: Marlin 2.1.2 src/gcode/config/M200-M205.cpp (M203 in mm/s, M205 B in µs; the most that
// M205 J takes).
#include <fmt/core.h>

#include <string>
#include <vector>

#include "command_line.hpp"
#include "firmware_dialect.hpp"
#include "unflex/core/firmware_spec.hpp"

namespace unflex::firmware::marlin {
namespace {

using emit::CommandLine;
using emit::RunLimits;
using emit::ShaperAxes;
using gcode::Shaper;
using planner::FirmwareConfig;
using planner::Limits;

constexpr double kMicroseconds = 1e6;

void limit_lines(const FirmwareConfig& config, const Limits& wanted, const Limits& current,
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
  if (config.classic_jerk) {
    advanced.axes(wanted.axis_jerk_mm_s, current.axis_jerk_mm_s);
  } else {
    advanced.word("J", wanted.junction_deviation_mm, current.junction_deviation_mm);
  }
  advanced.word("S", wanted.min_velocity_mm_s, current.min_velocity_mm_s);
  advanced.word("T", wanted.min_travel_velocity_mm_s, current.min_travel_velocity_mm_s);
  advanced.word("B", wanted.min_segment_time_s, current.min_segment_time_s, kMicroseconds);
  advanced.finish(lines);
}

void set_run_limits(const FirmwareConfig& /*config*/, const RunLimits& run, Limits& limits) {
  constexpr double kMostDeviation_mm = 0.3;
  limits.junction_deviation_mm = kMostDeviation_mm;
  limits.min_velocity_mm_s = 0.0;
  limits.min_travel_velocity_mm_s = 0.0;
  limits.min_segment_time_s = 0.0;
  emit::set_axis_limits(run, limits);
}

void shaper_lines(const Shaper& wanted, const Shaper& /*current*/, ShaperAxes axes,
                  std::vector<std::string>& lines) {
  for_each_axis(
      [&](std::string_view letter, bool is_set, double freq_hz) {
        if (is_set) {
          lines.push_back(fmt::format("M593 {} F{}", letter, freq_hz));
        }
      },
      kAxisLetters, axes, wanted.freq_hz);
}

std::string unknown_shaper_lines(ShaperAxes axes) {
  std::string lines;
  for_each_axis(
      [&](std::string_view letter, bool is_unknown) {
        if (is_unknown) {
          lines += fmt::format("{}M593 {} F...", lines.empty() ? "" : " and ", letter);
        }
      },
      kAxisLetters, axes);
  return lines;
}

}  // namespace

extern constexpr emit::FirmwareDialect kDialect = {.limit_lines = limit_lines,
                                                   .set_run_limits = set_run_limits,
                                                   .shaper_lines = shaper_lines,
                                                   .unknown_shaper_lines = unknown_shaper_lines};

}  // namespace unflex::firmware::marlin
