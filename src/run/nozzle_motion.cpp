#include "unflex/run/nozzle_motion.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "unflex/emit/emitter.hpp"

namespace unflex::run {
namespace {

// How the deviation of a nozzle develops while its base stands still.
dynamics::NozzleState swing(const dynamics::FlexibleAxis& axis,
                            const dynamics::NozzleState& deviation, double duration_s) {
  return dynamics::exact_step(axis, deviation, {}, duration_s);
}

}  // namespace

dynamics::NozzleXY at_rest(const gcode::Position& position, const verify::NozzleModel& model) {
  return {model.x.riding(position[gcode::X]), model.y.riding(position[gcode::Y])};
}

dynamics::NozzleXY at_end_of(const planner::PlannedMove& move, const verify::NozzleModel& model) {
  const gcode::Position& end = move.segment.end_mm;
  const double v = move.end_v_mm_s;
  return {model.x.riding(end[gcode::X], v * move.direction[gcode::X]),
          model.y.riding(end[gcode::Y], v * move.direction[gcode::Y])};
}

// Goes phase by phase, since the acceleration changes between phases.
void advance(const planner::PlannedMove& move, double from_s, double to_s,
             const verify::NozzleModel& model, dynamics::NozzleXY& nozzle) {
  double t = from_s;
  double end_s = 0.0;
  for (const planner::Phase& phase : move.phases()) {
    end_s += phase.duration_s;
    const double until_s = std::min(to_s, end_s);
    if (until_s <= t) {
      continue;
    }
    const gcode::Position p = move.position_mm(t);
    const double v = move.velocity_mm_s(t);
    const auto step = [&](gcode::Axis axis, const dynamics::FlexibleAxis& flexible,
                          const dynamics::NozzleState& state) {
      const double ratio = move.kinematic ? move.direction[axis] : 0.0;
      return dynamics::exact_step(flexible, state, {p[axis], v * ratio, phase.accel_mm_s2 * ratio},
                                  until_s - t);
    };
    nozzle.x = step(gcode::X, model.x, nozzle.x);
    nozzle.y = step(gcode::Y, model.y, nozzle.y);
    t = until_s;
  }
}

double across_mm(const gcode::Segment& segment, double x_mm, double y_mm) {
  return std::abs(segment.delta(gcode::X) * y_mm - segment.delta(gcode::Y) * x_mm) /
         segment.length_xy_mm();
}

NozzleFollower::NozzleFollower(const verify::NozzleModel& model,
                               const planner::FirmwareConfig& config, const gcode::Shaper& shaper)
    : model_(model),
      config_(config),
      printer_(shaper),
      present_(shaper),
      shaping_(planner::shaping(config, shaper)) {}

double NozzleFollower::follow(const Piece& piece) {
  double stops_s = 0.0;
  std::size_t next = 0;
  for (std::size_t i = 0; i < piece.events.size(); ++i) {
    const gcode::Event& event = piece.events[i];
    if (emit::moves_by_itself(event)) {
      stops_s += change(printer_, piece.pressure_advance);
    }
    for (std::size_t k = 0; k < piece.move_counts[i]; ++k, ++next) {
      const planner::PlannedMove move = planner::as_played(piece.moves[next]);
      if (!move.segment.start_known && !move.segment.start_assumed) {
        // The start is not known. All that is known is that the machine starts at rest.
        set(at_rest(move.segment.start_mm, model_), move.segment.start_mm);
      }
      advance(move, 0.0, move.duration_s(), model_, driven_);
      ringing_ = {swing(model_.x, ringing_.x, move.duration_s()),
                  swing(model_.y, ringing_.y, move.duration_s())};
      base_mm_ = {move.segment.end_mm[gcode::X], move.segment.end_mm[gcode::Y]};
    }
    if (event.position_lost) {
      // Homing and macros take their time: the nozzle has come to rest.
      const gcode::Position base_mm{base_mm_[0], base_mm_[1], 0.0, 0.0};
      set(at_rest(base_mm, model_), base_mm);
    } else if (event.dwell_s > 0.0) {
      pause(event.dwell_s);
    }
    if (event.sets_shaper) {
      // The sliced file has this stop too, so it does not count as added.
      printer_ = *event.shaper;
      static_cast<void>(change(printer_, piece.pressure_advance));
    }
  }
  return stops_s;
}

double NozzleFollower::begin_run(const Piece& run) { return change({}, run.pressure_advance); }

void NozzleFollower::set(const dynamics::NozzleXY& nozzle, const gcode::Position& base) {
  driven_ = nozzle;
  ringing_ = {};
  base_mm_ = {base[gcode::X], base[gcode::Y]};
}

void NozzleFollower::pause(double duration_s) {
  driven_.x = dynamics::exact_step(model_.x, driven_.x, {base_mm_[0], 0.0, 0.0}, duration_s);
  driven_.y = dynamics::exact_step(model_.y, driven_.y, {base_mm_[1], 0.0, 0.0}, duration_s);
  ringing_ = {swing(model_.x, ringing_.x, duration_s), swing(model_.y, ringing_.y, duration_s)};
}

// Switches the shaper. Meanwhile the machine stands still: the motion that the old shaper has
// delayed ends, and the nozzle rings.
double NozzleFollower::change(const gcode::Shaper& next, const gcode::PressureAdvance& advance) {
  const double stop_s = planner::switching_s(config_, {present_, advance}, {next, advance});
  if (stop_s == 0.0) {
    return stop_s;
  }
  const auto after_stop =
      [&](const dynamics::FlexibleAxis& axis, const dynamics::ShaperPulses& pulses,
          const dynamics::NozzleState& driven, const dynamics::NozzleState& ringing,
          const dynamics::NozzleState& rest) {
        dynamics::NozzleState deviation = driven;
        deviation.add(rest, -1.0);
        dynamics::NozzleState sum = swing(axis, ringing, stop_s);
        const auto add = [&](double weight, double since_s) {
          sum.add(swing(axis, deviation, std::max(0.0, since_s)), weight);
        };
        if (pulses.empty()) {
          add(1.0, stop_s);
        }
        for (const dynamics::Pulse& pulse : pulses) {
          add(pulse.weight, stop_s - pulse.time_s);
        }
        return sum;
      };
  const dynamics::NozzleXY rest = at_rest({base_mm_[0], base_mm_[1], 0.0, 0.0}, model_);
  const dynamics::NozzleXY ringing{after_stop(model_.x, shaping_.x, driven_.x, ringing_.x, rest.x),
                                   after_stop(model_.y, shaping_.y, driven_.y, ringing_.y, rest.y)};
  present_ = next;
  shaping_ = planner::shaping(config_, next);
  driven_ = rest;
  if (shaping_.acts()) {
    ringing_ = ringing;
    return stop_s;
  }
  driven_.x.add(ringing.x);
  driven_.y.add(ringing.y);
  ringing_ = {};
  return stop_s;
}

}  // namespace unflex::run
