// Source: Klipper docs/G-Codes.md (SET_VELOCITY_LIMIT, SET_INPUT_SHAPER, SET_PRESSURE_ADVANCE).
#include <fmt/core.h>

#include <functional>
#include <string>
#include <vector>

#include "command_line.hpp"
#include "firmware_dialect.hpp"
#include "unflex/core/firmware_spec.hpp"

namespace unflex::firmware::klipper {
namespace {

using emit::CommandLine;
using emit::RunLimits;
using emit::ShaperAxes;
using gcode::Shaper;
using planner::FirmwareConfig;
using planner::Limits;

void limit_lines(const FirmwareConfig& /*config*/, const Limits& wanted, const Limits& current,
                 std::vector<std::string>& lines) {
  CommandLine line(emit::kKlipperLimits);
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
            to_decel ? emit::kUnknown : current.minimum_cruise_ratio);
  line.word("ACCEL_TO_DECEL=", wanted.accel_to_decel_mm_s2, current.accel_to_decel_mm_s2);
  line.finish(lines);
}

void set_run_limits(const FirmwareConfig& /*config*/, const RunLimits& run, Limits& limits) {
  limits.max_velocity_mm_s = run.velocity_mm_s;
  limits.max_accel_mm_s2 = run.accel_mm_s2;
  limits.square_corner_velocity_mm_s = run.corner_velocity_mm_s;
  limits.minimum_cruise_ratio = 0.0;
  limits.accel_to_decel_mm_s2 = run.accel_mm_s2;
}

std::string shaper_line(ShaperAxes axes, const Axes<std::string>& freq_hz) {
  std::string line = "SET_INPUT_SHAPER";
  for_each_axis(
      [&](std::string_view letter, bool is_set, const std::string& value) {
        line += is_set ? fmt::format(" SHAPER_FREQ_{}={}", letter, value) : "";
      },
      kAxisLetters, axes, freq_hz);
  return line;
}

void shaper_lines(const Shaper& wanted, const Shaper& /*current*/, ShaperAxes axes,
                  std::vector<std::string>& lines) {
  if (any_axis(std::identity{}, axes)) {
    const auto text = [](double freq_hz) { return fmt::format("{}", freq_hz); };
    lines.push_back(shaper_line(axes, map_axes(text, wanted.freq_hz)));
  }
}

std::string advance_line(const gcode::PressureAdvance& wanted) {
  return fmt::format("SET_PRESSURE_ADVANCE{}{} ADVANCE={}{}",
                     wanted.extruder.empty() ? "" : " EXTRUDER=", wanted.extruder,
                     wanted.advance_s.value(),
                     wanted.smooth_s ? fmt::format(" SMOOTH_TIME={}", *wanted.smooth_s) : "");
}

std::string unknown_shaper_lines(ShaperAxes axes) {
  return shaper_line(axes, on_all_axes<std::string>("..."));
}

}  // namespace

extern constexpr emit::FirmwareDialect kDialect = {.limit_lines = limit_lines,
                                                   .set_run_limits = set_run_limits,
                                                   .shaper_lines = shaper_lines,
                                                   .advance_line = advance_line,
                                                   .unknown_shaper_lines = unknown_shaper_lines};

}  // namespace unflex::firmware::klipper
