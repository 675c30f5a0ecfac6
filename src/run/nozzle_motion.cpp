#include "unflex/run/nozzle_motion.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "unflex/dynamics/shaped.hpp"
#include "unflex/emit/emitter.hpp"

namespace unflex::run {
namespace {

// How the deviation of a nozzle develops while its base stands still.
dynamics::NozzleState swing(const dynamics::FlexibleAxis& axis,
                            const dynamics::NozzleState& deviation, double duration_s) {
  return dynamics::exact_step(axis, deviation, {}, duration_s);
}

dynamics::NozzleXY swing(const verify::NozzleModel& model, const dynamics::NozzleXY& deviation,
                         double duration_s) {
  if (model.frame) {
    dynamics::NozzleXY later = deviation;
    model.frame->advance({}, {}, duration_s, later);
    return later;
  }
  return map_axes(
      [&](const dynamics::FlexibleAxis& axis, const dynamics::NozzleState& of_axis) {
        return swing(axis, of_axis, duration_s);
      },
      model, deviation);
}

}  // namespace

dynamics::NozzleXY at_rest(const gcode::Position& position, const verify::NozzleModel& model) {
  return verify::riding(model, xy_of(position));
}

dynamics::NozzleXY at_end_of(const planner::PlannedMove& move, const verify::NozzleModel& model) {
  return verify::riding(model, xy_of(move.segment.end_mm), move.end_v_mm_s * xy_of(move.direction));
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
    const double v = move.velocity_mm_s(t);
    if (model.frame) {
      const double moves = move.kinematic ? 1.0 : 0.0;
      const auto along = [&](double size) {
        return dynamics::ModeFrame::Vector{size * move.direction[0], size * move.direction[1],
                                           size * move.direction[2]};
      };
      model.frame->advance(along(moves * v), along(moves * phase.accel_mm_s2), until_s - t, nozzle);
      t = until_s;
      continue;
    }
    nozzle = map_axes(
        [&](const dynamics::FlexibleAxis& axis, const dynamics::NozzleState& state, double place_mm,
            double ratio) {
          return dynamics::exact_step(axis, state, {place_mm, v * ratio, phase.accel_mm_s2 * ratio},
                                      until_s - t);
        },
        model, nozzle, xy_of(move.position_mm(t)), move.kinematic ? xy_of(move.direction) : XY{});
    t = until_s;
  }
}

// The base's acceleration is linear between nodes. Its mean over a quarter of the way to the next
// node serves that quarter.
XY NozzleOnBase::advance_swing(std::size_t k) {
  constexpr int kParts = 4;
  const double h = base_->period_s / kParts;
  for (int i = 0; i < kParts; ++i) {
    const auto at = [&](double parts) {
      return map_axes(
          [&](const dynamics::AxisTrajectory& axis) {
            return dynamics::between(axis, k, parts * h, base_->period_s);
          },
          *base_);
    };
    const auto above = [&](double parts) {
      return base_->above ? dynamics::between(*base_->above, k, parts * h, base_->period_s)
                          : dynamics::AxisMotion{};
    };
    const Axes<dynamics::AxisMotion> begin = at(i);
    const Axes<dynamics::AxisMotion> middle = at(i + 0.5);
    frame_->advance({begin.x.velocity_mm_s, begin.y.velocity_mm_s, above(i).velocity_mm_s},
                    {middle.x.accel_mm_s2, middle.y.accel_mm_s2, above(i + 0.5).accel_mm_s2}, h,
                    nozzle_);
  }
  const auto ahead = frame_->ahead(nozzle_);
  return base_->node_mm(k + 1) + XY{ahead[0].position, ahead[1].position};
}

double across_mm(const gcode::Segment& segment, const XY& offset_mm) {
  return std::abs(cross(segment.way_xy_mm(), offset_mm)) / segment.length_xy_mm();
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
      ringing_ = swing(model_, ringing_, move.duration_s());
      base_mm_ = xy_of(move.segment.end_mm);
    }
    if (event.position_lost) {
      // Homing and macros take their time: the nozzle has come to rest.
      const gcode::Position base_mm{base_mm_.x, base_mm_.y, 0.0, 0.0};
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
  base_mm_ = xy_of(base);
}

void NozzleFollower::pause(double duration_s) {
  driven_ = model_.frame
                ? swing(model_, driven_, duration_s)
                : map_axes(
                      [&](const dynamics::FlexibleAxis& axis, const dynamics::NozzleState& state,
                          double base_mm) {
                        return dynamics::exact_step(axis, state, {base_mm, 0.0, 0.0}, duration_s);
                      },
                      model_, driven_, base_mm_);
  ringing_ = swing(model_, ringing_, duration_s);
}

// Switches the shaper. Meanwhile the machine stands still: the motion that the old shaper has
// delayed ends, and the nozzle rings.
double NozzleFollower::change(const gcode::Shaper& next, const gcode::PressureAdvance& advance) {
  const double stop_s = planner::switching_s(config_, {present_, advance}, {next, advance});
  if (stop_s == 0.0) {
    return stop_s;
  }
  const auto after_stop = [&](const dynamics::FlexibleAxis& axis,
                              const dynamics::ShaperPulses& pulses,
                              const dynamics::NozzleState& driven,
                              const dynamics::NozzleState& ringing,
                              const dynamics::NozzleState& rest) {
    dynamics::NozzleState deviation = driven;
    deviation.add(rest, -1.0);
    return dynamics::shaped_at<dynamics::NozzleState>(
        pulses, stop_s,
        [&](std::size_t, double since_s) { return swing(axis, deviation, std::max(0.0, since_s)); },
        swing(axis, ringing, stop_s));
  };
  const dynamics::NozzleXY rest = verify::riding(model_, base_mm_);
  // A shaper delays X and Y differently, and modes that lie along neither mix them. What still
  // swings behind a shaper is little, so such a nozzle counts as at rest.
  const dynamics::NozzleXY ringing =
      model_.frame ? dynamics::NozzleXY{}
                   : map_axes(after_stop, model_, shaping_, driven_, ringing_, rest);
  present_ = next;
  shaping_ = planner::shaping(config_, next);
  driven_ = rest;
  if (shaping_.acts()) {
    ringing_ = ringing;
    return stop_s;
  }
  for_each_axis(
      [](dynamics::NozzleState& state, const dynamics::NozzleState& other) { state.add(other); },
      driven_, ringing);
  ringing_ = {};
  return stop_s;
}

}  // namespace unflex::run
