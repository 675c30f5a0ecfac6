#include "unflex/run/move_bounds.hpp"

#include <algorithm>

#include "unflex/machine/as_printer.hpp"

namespace unflex::run {
namespace {

// The speed at which the move takes as much filament as the hotend melts, with some room, as the
// nozzle may be 2 % ahead for a moment.
double speed_by_flow(const planner::PlannedMove& move, const machine::Settings& settings) {
  constexpr double kRoom = 0.98;
  constexpr double kLeast_mm_s = 1.0;
  const std::optional<double> max_flow_mm3_s = settings.extruder.max_flow_mm3_s;
  if (!max_flow_mm3_s || !move.segment.extruding()) {
    return planner::kNoLimit;
  }
  return std::max(
      kRoom * *max_flow_mm3_s / (move.direction[gcode::E] * settings.filament_area_mm2()),
      kLeast_mm_s);
}

timing::MoveBounds free_bounds(const planner::PlannedMove& move, const machine::Settings& settings,
                               const planner::Limits& limits,
                               const planner::FirmwareConfig& config) {
  const gcode::Segment& segment = move.segment;
  timing::MoveBounds bounds = timing::bounds_by_axes(move, limits, config);
  // The nozzle may run a little ahead of its limit (timing::kKeptFeed). Travel leaves this room
  // free.
  constexpr double kOfTravel = 0.985;
  const double feed_mm_s = segment.extruding()
                               ? segment.feed_mm_s
                               : settings.timing.max_speed_mm_s.value_or(segment.feed_mm_s);
  const double by_flow_mm_s = speed_by_flow(move, settings);
  bounds.nozzle_speed_mm_s = segment.extruding() ? by_flow_mm_s : kOfTravel * feed_mm_s;
  bounds.speed_mm_s = std::min({bounds.speed_mm_s, feed_mm_s, by_flow_mm_s});
  if (settings.timing.keep_accel_limits && move.accel_mm_s2 > 0.0) {
    bounds.accel_mm_s2 = std::min(bounds.accel_mm_s2, move.accel_mm_s2);
  }
  return bounds;
}

// The move is no faster anywhere than it was sliced.
timing::MoveBounds bounds_as_sliced(const planner::PlannedMove& move) {
  return {.speed_mm_s = move.cruise_v_mm_s,
          .accel_mm_s2 = move.accel_mm_s2 > 0.0 ? move.accel_mm_s2 : planner::kNoLimit,
          .start_speed_mm_s = move.start_v_mm_s,
          .end_speed_mm_s = move.end_v_mm_s};
}

}  // namespace

std::vector<timing::MoveBounds> move_bounds(const Piece& run, const machine::Settings& settings) {
  const planner::FirmwareConfig config = machine::firmware_config(settings);
  const planner::Limits limits = machine::planner_limits(settings);
  std::vector<timing::MoveBounds> bounds;
  for (std::size_t event = 0; event < run.move_counts.size(); ++event) {
    for (std::size_t count = run.move_counts[event]; count > 0; --count) {
      const planner::PlannedMove& move = run.moves[bounds.size()];
      const gcode::FeatureKind kind =
          move.segment.extruding() ? run.features[event] : gcode::FeatureKind::travel;
      timing::MoveBounds own = settings.timing.is_free(kind)
                                   ? free_bounds(move, settings, limits, config)
                                   : bounds_as_sliced(move);
      own.tolerance_mm = settings.timing.tolerance_of_um(kind) * 1e-3;
      bounds.push_back(own);
    }
  }
  return bounds;
}

std::optional<timing::Extruder> extruder_of(const Piece& run, const emit::EmitOptions& options,
                                            const machine::TimingSettings& timing) {
  const dynamics::HotendPressure hotend = emit::hotend_of(options, run.start.advance);
  if (!options.pressure.is_written || hotend.advance_s == 0.0 || timing.width_tolerance == 0.0) {
    return std::nullopt;
  }
  return timing::Extruder{hotend, options.pressure.max_accel_mm_s2, timing.width_tolerance};
}

}  // namespace unflex::run
