// Forgets what is no longer known behind lines that may do anything, or that may or may not be
// carried out.
#include <fmt/core.h>
#include <fmt/format.h>

#include <array>

#include "unflex/core/firmware_spec.hpp"
#include "unflex/gcode/interpreter.hpp"

namespace unflex::gcode {
namespace {

// Whether the modes are equal. If a line that may or may not run changes one, what follows is
// uncertain. F and places are not compared: the next word that gives them makes them known again.
bool same_modes(const ModalState& a, const ModalState& b) {
  return a.absolute_xyz == b.absolute_xyz && a.absolute_e == b.absolute_e &&
         a.unit_mm == b.unit_mm && a.speed_factor == b.speed_factor &&
         a.filament_factor() == b.filament_factor() && a.plane == b.plane &&
         a.retraction.retracted == b.retraction.retracted && a.inverse_time == b.inverse_time &&
         a.shaper.freq_hz.x == b.shaper.freq_hz.x && a.shaper.settings == b.shaper.settings;
}

}  // namespace

void Interpreter::limits_unknown(Event& event) {
  lose_position(event);
  event.warnings.push_back(fmt::format(
      "{}{} may change the limits to ones not in this file; those known so far are kept",
      command_.letter, command_.number));
}

void Interpreter::uncertain_modes(Event& event, std::string_view cause) {
  lose_position(event);
  if (!modes_uncertain_) {
    modes_uncertain_ = true;
    event.warnings.push_back(fmt::format("{}: what follows is passed through unchanged", cause));
  }
}

void Interpreter::maybe(Event& event, void (Interpreter::*carry_out)(Event&),
                        std::string_view cause) {
  Interpreter trial = *this;
  Event tried;
  (trial.*carry_out)(tried);
  if (!same_modes(state_, trial.state_) || tried.kind == EventKind::limits ||
      trial.modes_uncertain_ != modes_uncertain_) {
    return uncertain_modes(event, cause);
  }
  feed_uncertain_ = feed_uncertain_ || trial.state_.feed_mm_s != state_.feed_mm_s;
  lose_position(event);
}

void Interpreter::doubtful_line(Event& event, void (Interpreter::*carry_out)(Event&),
                                std::string_view problem) {
  maybe(event, carry_out, problem);
  if (event.warnings.empty()) {
    not_understood(event, problem);
  }
}

void Interpreter::lose_position(Event& event) {
  event.kind = EventKind::barrier;
  event.position_lost = true;
  state_.known.fill(false);
  assumed_.fill(false);
  state_.shaper_touched = on_all_axes(true);
  // Another extruder may be in use, so the next value may stop the machine. The last value known is
  // still the best guess.
  if (options_.advance_of_runs != RunAdvance::on) {
    pressure_advance_on_.reset();
  }
  if (spec_of(options_.firmware).reading.macros_select_tools) {
    lose_tool();
  }
}

void Interpreter::doubt_position(Event& event) {
  const std::array<bool, 4> before = known_or_assumed();
  lose_position(event);
  assumed_ = {before[X], before[Y]};
}

void Interpreter::not_understood(Event& event, std::string_view problem) {
  lose_position(event);
  event.warnings.push_back(fmt::format("{}: passed through unchanged; check the line", problem));
}

}  // namespace unflex::gcode
