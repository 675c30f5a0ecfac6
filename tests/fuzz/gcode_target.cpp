// Lines, their meaning to each firmware, and its plan of them.
#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "bytes.hpp"
#include "planner/rrf_limits.hpp"
#include "playback.hpp"
#include "targets.hpp"
#include "unflex/gcode/time_note.hpp"
#include "unflex/planner/rrf_planner.hpp"

namespace unflex::fuzz {
namespace {

constexpr std::size_t kMostSegments = 20'000;

// '0' Klipper, '1' Marlin, '2' RepRapFirmware; '3' to '5': these firmwares in another
// configuration.
PrinterSetup printer_setup(std::size_t variant) {
  const Firmware firmware =
      std::array{Firmware::klipper, Firmware::marlin, Firmware::rrf}[variant % 3];
  PrinterSetup setup;
  setup.interpreter = gcode::default_options(firmware);
  setup.fixed.firmware = firmware;
  if (firmware == Firmware::rrf) {
    setup.limits = planner::testing::rrf_default_limits();
  }
  if (variant >= 3) {
    setup.interpreter.firmware_retraction = !setup.interpreter.firmware_retraction;
    setup.interpreter.retract_length_mm = 0.7;
    setup.interpreter.retract_z_hop_mm = 0.3;
    setup.interpreter.arc_resolution_mm = 0.1;
    setup.interpreter.marlin_arcs.circles = true;
    setup.interpreter.marlin_arcs.segments_per_s = 40.0;
    setup.interpreter.shaper_freq_hz.x = 45.0;
    setup.fixed.classic_jerk = true;
    setup.fixed.jd_handle_small_segments = false;
    setup.fixed.block_buffer_size = setup.fixed.ring_length = 4;
    setup.limits.jerk_policy = 1;
  }
  return setup;
}

// How much rounding to whole steps may add to the speed of an axis; for Marlin also its minimum
// speed.
double allowance_mm_s(const planner::PlannedMove& move, const planner::FirmwareConfig& fixed,
                      std::size_t axis) {
  if (fixed.firmware == Firmware::rrf) {
    // The direction is computed from whole steps, and from coordinates in single precision.
    const double coordinate_mm =
        2e-7 * (std::abs(move.segment.start_mm[axis]) + std::abs(move.segment.end_mm[axis]));
    return move.cruise_v_mm_s * (1.0 / fixed.steps_per_mm[axis] + coordinate_mm) / move.length_mm;
  }
  double steps = 1.0;
  for (std::size_t i = 0; i < 4; ++i) {
    steps = std::max(
        steps, std::abs(move.segment.delta(static_cast<gcode::Axis>(i))) * fixed.steps_per_mm[i]);
  }
  return std::abs(move.direction[axis]) *
         (120.0 * move.length_mm / steps + fixed.minimum_planner_speed_mm_s);
}

void check_speeds(const planner::PlannedMove& move, const Given& given,
                  const planner::FirmwareConfig& fixed) {
  const planner::Limits limits = planner::as_accepted(fixed.firmware, given.limits);
  const std::string place = fmt::format("line {}: ", move.segment.line);
  if (fixed.firmware == Firmware::klipper) {
    const double fastest = move.kinematic
                               ? std::min(given.segment.feed_mm_s, limits.max_velocity_mm_s)
                               : given.segment.feed_mm_s;
    require(move.cruise_v_mm_s <= fastest * (1.0 + 1e-9), place + "faster than asked or allowed");
    require(!move.kinematic || move.accel_mm_s2 <= limits.max_accel_mm_s2 * (1.0 + 1e-9),
            place + "accelerates more than allowed");
    return;
  }
  for (std::size_t axis = 0; axis < 4; ++axis) {
    const double share = std::abs(move.direction[axis]);
    const double least = std::max({0.0, limits.min_velocity_mm_s, limits.min_travel_velocity_mm_s,
                                   limits.min_movement_velocity_mm_s});
    require(share * move.cruise_v_mm_s <=
                std::max(limits.axis_max_velocity_mm_s[axis], share * least) * (1.0 + 1e-3) +
                    allowance_mm_s(move, fixed, axis),
            place + fmt::format("axis {} at {} mm/s is faster than {} mm/s", axis,
                                share * move.cruise_v_mm_s, limits.axis_max_velocity_mm_s[axis]));
  }
}

void check_move(const planner::PlannedMove& move) {
  const std::string place = fmt::format("line {}: ", move.segment.line);
  for (const double value : {move.accel_s, move.cruise_s, move.decel_s, move.start_v_mm_s,
                             move.cruise_v_mm_s, move.end_v_mm_s, move.length_mm}) {
    require(std::isfinite(value) && value >= 0.0,
            place + fmt::format("{} is no duration, speed or length", value));
  }
  require(move.duration_s() > 0.0, place + "motion in no time");
  require(std::isfinite(move.accel_mm_s2), place + "no acceleration");
  for (const double t : {0.0, 0.5 * move.duration_s(), move.duration_s()}) {
    const double distance = move.distance_mm(t);
    require(distance >= 0.0 && distance <= move.length_mm * (1.0 + 1e-6) + 1e-9,
            place + fmt::format("{} mm along a move of {} mm", distance, move.length_mm));
  }
}

}  // namespace

void gcode(std::string_view bytes) {
  Bytes source(bytes);
  const PrinterSetup setup = printer_setup(source.variant(6));
  const std::string text(source.rest());
  const Playback playback = play(text, setup, kMostSegments);
  require(playback.whole ? playback.text == text : text.starts_with(playback.text),
          "the lines are not the text");
  for (const gcode::Event& event : playback.events) {
    const std::string_view content = event.line.content();
    require(gcode::same_but_for_times(
                content, gcode::with_times_scaled(content, gcode::TimeFactors::even(1.5))),
            "a line with its times scaled is another line");
  }
  // Segments that are too small to be queued have no move. The line number tells which segment a
  // move comes from; all pieces of an arc have equal limits and speeds.
  std::size_t next = 0;
  for (const planner::PlannedMove& move : playback.moves) {
    check_move(move);
    while (next < playback.given.size() && playback.given[next].segment.line < move.segment.line) {
      ++next;
    }
    require(next < playback.given.size() && playback.given[next].segment.line == move.segment.line,
            "a move of no line");
    check_speeds(move, playback.given[next], setup.fixed);
  }
}

}  // namespace unflex::fuzz
