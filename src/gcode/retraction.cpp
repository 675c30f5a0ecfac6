// G10 and G11: the firmware's own retraction.
#include <cmath>

#include "unflex/core/number.hpp"
#include "unflex/gcode/interpreter.hpp"

namespace unflex::gcode {
namespace {

constexpr double kSecondsPerMinute = 60.0;
// The hop goes as fast as the planner lets Z. RepRapFirmware asks for ImpossiblyHighFeedRate,
// Marlin for the limit of M203 itself.
constexpr double kHopSpeed_mm_s = 10000.0;

}  // namespace

Interpreter::Start Interpreter::start_of_retraction() const {
  const auto all = [](const std::array<bool, 4>& known) { return is_xy_known(known) && known[Z]; };
  const bool known = all(state_.known);
  return {known, !known && all(known_or_assumed())};
}

// firmware_retraction.py, cmd_G10 and cmd_G11: a relative E move between saving and restoring the
// G-code state, so that E reads as before. The length is written with five decimals and the speed
// in whole mm/min, and the flow and speed factors apply to both.
void Interpreter::firmware_retraction(Event& event, bool retract) {
  if (!options_.firmware_retraction) {
    if (!told_of_retraction_) {
      told_of_retraction_ = true;
      event.warnings.emplace_back(
          "the printer has no [firmware_retraction], so that G10 and G11 retract nothing, here and "
          "below; add that section to printer.cfg or switch firmware retraction off in the slicer");
    }
    return;
  }
  if (state_.retraction.retracted == retract) {
    event.kind = EventKind::barrier;  // a macro may have changed the state, and then the line moves
    return;
  }
  state_.retraction.retracted = retract;
  const double length_mm = retract
                               ? -options_.retract_length_mm
                               : options_.retract_length_mm + options_.unretract_extra_length_mm;
  const double speed_mm_s = retract ? options_.retract_speed_mm_s : options_.unretract_speed_mm_s;
  constexpr int kDecimals = 5;
  const double travel_mm = static_cast<double>(to_scaled(length_mm, kDecimals)) /
                           power_of_ten(kDecimals) * state_.flow_factor;
  const double feed_mm_s = std::trunc(speed_mm_s * kSecondsPerMinute) / kSecondsPerMinute;
  Position target = state_.position_mm;
  target[E] += travel_mm;
  state_.base_mm[E] += travel_mm;
  append_segment(event, target, feed_mm_s * state_.speed_factor, start_of_retraction());
  if (event.segments.empty() && !options_.retract_length_is_told) {
    event.kind = EventKind::barrier;  // the printer may have a length, and then it stops
  }
}

// Marlin: feature/fwretract.cpp, FWRetract::retract. RepRapFirmware: GCodes.cpp, RetractFilament,
// and GCodes4.cpp, doingFirmwareRetraction. Neither M220 nor M221 applies; readings stay; Z is
// lifted after the filament is drawn back and lowered before it is pushed on.
void Interpreter::retraction_and_hop(Event& event, bool retract) {
  if (state_.retraction.retracted == retract) {
    // A macro may have changed the state, or the tool may be another: then the line moves.
    event.kind = EventKind::barrier;
    return;
  }
  state_.retraction.retracted = retract;
  Start start = start_of_retraction();
  start.known = start.known && modes_certain();
  start.assumed = start.assumed && modes_certain();
  const auto shift = [&](Axis axis, double by_mm, double feed_mm_s) {
    Position target = state_.position_mm;
    target[axis] += by_mm;
    state_.base_mm[axis] += by_mm;
    // Without a speed (M207 F0) Marlin goes as fast as it went last (module/motion.cpp,
    // _internal_move_to_destination).
    append_segment(event, target, feed_mm_s > 0.0 ? feed_mm_s : state_.feed_mm_s, start);
  };
  if (retract) {
    shift(E, -options_.retract_length_mm, options_.retract_speed_mm_s);
    state_.retraction.hop_mm = options_.retract_z_hop_mm;
    shift(Z, state_.retraction.hop_mm, kHopSpeed_mm_s);
  } else {
    shift(Z, -state_.retraction.hop_mm, kHopSpeed_mm_s);
    state_.retraction.hop_mm = 0.0;
    shift(E, options_.retract_length_mm + options_.unretract_extra_length_mm,
          options_.unretract_speed_mm_s);
  }
  if (event.segments.empty()) {
    event.kind = EventKind::barrier;  // the length is not known here, but the machine stops
  }
}

}  // namespace unflex::gcode
