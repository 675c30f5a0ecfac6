#include "nozzle_motion.hpp"

#include <algorithm>
#include <array>
#include <cstddef>

namespace unflex::pipeline {

dynamics::NozzleXY at_rest(const gcode::Position& position) {
  return {{position[gcode::X], 0.0}, {position[gcode::Y], 0.0}};
}

dynamics::NozzleXY at_end_of(const planner::PlannedMove& move) {
  const gcode::Position& end = move.segment.end_mm;
  const double v = move.end_v_mm_s;
  return {{end[gcode::X], v * move.direction[gcode::X]},
          {end[gcode::Y], v * move.direction[gcode::Y]}};
}

// Phase by phase: the acceleration changes where one ends.
void advance(const planner::PlannedMove& move, double from_s, double to_s,
             const verify::NozzleModel& model, dynamics::NozzleXY& nozzle) {
  const std::array<double, 3> ends_s = {move.accel_s, move.accel_s + move.cruise_s,
                                        move.duration_s()};
  const std::array<double, 3> accels = {move.accel_mm_s2, 0.0, -move.accel_mm_s2};
  double t = from_s;
  for (std::size_t phase = 0; phase < ends_s.size(); ++phase) {
    const double until_s = std::min(to_s, ends_s[phase]);
    if (until_s <= t) {
      continue;
    }
    const gcode::Position p = move.position_mm(t);
    const double v = move.velocity_mm_s(t);
    const auto step = [&](gcode::Axis axis, const dynamics::FlexibleAxis& flexible,
                          dynamics::NozzleState state) {
      const double ratio = move.kinematic ? move.direction[axis] : 0.0;
      return dynamics::exact_step(flexible, state, {p[axis], v * ratio, accels[phase] * ratio},
                                  until_s - t);
    };
    nozzle.x = step(gcode::X, model.x, nozzle.x);
    nozzle.y = step(gcode::Y, model.y, nozzle.y);
    t = until_s;
  }
}

dynamics::NozzleXY after_motion(const Piece& piece, dynamics::NozzleXY nozzle,
                                const verify::NozzleModel& model) {
  std::size_t next = 0;
  for (std::size_t i = 0; i < piece.events.size(); ++i) {
    const gcode::Event& event = piece.events[i];
    for (std::size_t k = 0; k < piece.move_counts[i]; ++k, ++next) {
      const planner::PlannedMove& move = piece.moves[next];
      if (!move.segment.start_known) {
        // From wherever the machine was: nothing is known but that it starts at rest.
        nozzle = at_rest(move.segment.start_mm);
      }
      advance(move, 0.0, move.duration_s(), model, nozzle);
    }
    if (event.position_lost) {
      // Homing and macros take their time: the nozzle has come to rest.
      nozzle.x.velocity = nozzle.y.velocity = 0.0;
    } else if (event.dwell_s > 0.0) {
      const auto rest = [&](const dynamics::FlexibleAxis& axis, dynamics::NozzleState state,
                            double base) {
        return dynamics::exact_step(axis, state, {base, 0.0, 0.0}, event.dwell_s);
      };
      const gcode::Position& at = next > 0 ? piece.moves[next - 1].segment.end_mm : piece.from_mm;
      nozzle = {rest(model.x, nozzle.x, at[gcode::X]), rest(model.y, nozzle.y, at[gcode::Y])};
    }
  }
  return nozzle;
}

}  // namespace unflex::pipeline
