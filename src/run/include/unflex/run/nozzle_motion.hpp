// The exact motion of the nozzle while the base moves as planned.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "unflex/dynamics/base_trajectory.hpp"
#include "unflex/dynamics/flexible_axis.hpp"
#include "unflex/dynamics/frequency_field.hpp"
#include "unflex/dynamics/node_map.hpp"
#include "unflex/planner/planner.hpp"
#include "unflex/planner/printer_shaper.hpp"
#include "unflex/run/piece_reader.hpp"
#include "unflex/verify/deviation.hpp"

namespace unflex::run {

[[nodiscard]] dynamics::NozzleXY at_rest(const gcode::Position& position,
                                         const verify::NozzleModel& model);

// A nozzle that follows the plan exactly, at the end of the move.
[[nodiscard]] dynamics::NozzleXY at_end_of(const planner::PlannedMove& move,
                                           const verify::NozzleModel& model);

// Takes the nozzle from one moment of the move to a later one, seconds after its start.
void advance(const planner::PlannedMove& move, double from_s, double to_s,
             const verify::NozzleModel& model, dynamics::NozzleXY& nozzle);

// Takes the nozzle from node to node of the base's motion.
class NozzleOnBase {
 public:
  // The base must outlive it. start: the nozzle at its first node.
  NozzleOnBase(const dynamics::BaseTrajectory& base, const verify::NozzleModel& model,
               const dynamics::FieldXY& field, const dynamics::NozzleXY& start)
      : base_(&base),
        frame_(model.frame),
        nozzle_(start),
        maps_(map_axes(
            [&](const dynamics::FlexibleAxis& axis, const dynamics::FrequencyField& of_axis) {
              return Maps(axis, of_axis, base.period_s);
            },
            model, field)) {}

  // From node k to the next. Returns the nozzle's place there.
  XY advance(std::size_t k) {
    if (frame_) {
      return advance_swing(k);
    }
    const XY at_mm = base_->node_mm(k);
    for_each_axis([&](Maps& maps, const dynamics::AxisTrajectory& base,
                      dynamics::NozzleState& state) { maps.at(at_mm).advance(base, k, state); },
                  maps_, *base_, nozzle_);
    return dynamics::place_mm(nozzle_);
  }

 private:
  using Maps = dynamics::FieldMaps<dynamics::NodeMap>;

  // Where modes do not lie along the axes.
  XY advance_swing(std::size_t k);

  const dynamics::BaseTrajectory* base_;
  std::optional<dynamics::ModeFrame> frame_;
  dynamics::NozzleXY nozzle_;
  Axes<Maps> maps_;
};

// The part of an offset that is across the segment, which moves in X or Y; without sign.
[[nodiscard]] double across_mm(const gcode::Segment& segment, const XY& offset_mm);

// The nozzle from piece to piece, the printer's own shaper included.
//
// A shaper's base is a weighted sum of shifted motions, b_s(t) = Σ A_i b(t − t_i), and the nozzle's
// response is linear. So the shaped nozzle is the same weighted sum for a nozzle u that hangs on
// the unshaped base. Only u is followed, from rest:
//
//   p(t) = Σ A_i u(t − t_i) + e^{-ζωt}(…)
//
//   u   the nozzle on the unshaped base        the second term: what still rings from the time
//                                              before the shaper was switched on
//
// The shaper is switched where the machine stands still for at least as long as its pulses reach,
// so that all u(t − t_i) needed then are of a base at rest.
class NozzleFollower {
 public:
  // At rest at the origin, under the shaper that the printer starts with.
  NozzleFollower(const verify::NozzleModel& model, const planner::FirmwareConfig& config,
                 const gcode::Shaper& shaper);

  // Follows the piece's own moves and pauses, with the shaper as the emitter leaves it there.
  // Returns how long the machine stands still because the emitter switches the shaper, s.
  double follow(const Piece& piece);
  // The emitter switches the shaper off for a run that begins. Returns how long the machine stands
  // still for it, s.
  double begin_run(const Piece& run);
  // The nozzle goes on with this model.
  void set_model(const verify::NozzleModel& model) { model_ = model; }
  // Sets the nozzle and the place of the base, where they are known.
  void set(const dynamics::NozzleXY& nozzle, const gcode::Position& base);

  // Meaningful where no shaper acts, as in and after runs.
  [[nodiscard]] const dynamics::NozzleXY& nozzle() const { return driven_; }

 private:
  double change(const gcode::Shaper& next, const gcode::PressureAdvance& advance);
  void pause(double duration_s);

  verify::NozzleModel model_;
  planner::FirmwareConfig config_;
  gcode::Shaper printer_;     // shaper that the input has set
  gcode::Shaper present_;     // shaper that acts in the output
  planner::Shaping shaping_;  // how present_ acts
  XY base_mm_;
  dynamics::NozzleXY driven_;   // u; without a shaper the nozzle itself
  dynamics::NozzleXY ringing_;  // the second term of p, as a deviation from the base
};

}  // namespace unflex::run
