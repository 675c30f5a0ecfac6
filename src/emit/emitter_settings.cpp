// Settings of the printer in a run and behind it: limits, input shaper, pressure advance, and the
// facts about them that a pause needs.
#include <fmt/core.h>

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "dialect.hpp"
#include "filament.hpp"
#include "unflex/core/firmware_spec.hpp"
#include "unflex/core/own_marks.hpp"
#include "unflex/emit/emitter.hpp"

namespace unflex::emit {

bool Emitter::move_may_wait() const {
  return move_waits_ && spec_of(options_.fixed.firmware).writing.limits_act_early;
}

// A line without motion is read only when the move before it has left the buffer.
void Emitter::wait_for_move(std::string& out) { write_feed(printer_.state().feed_mm_s, out); }

void Emitter::set_limits(const planner::Limits& limits, std::string& out, bool may_be_interrupted) {
  const planner::Limits current =
      limits_known_ ? limits_ : unknown_to_run(options_.fixed.firmware, limits_);
  const std::vector<std::string> lines = limit_lines(options_.fixed, limits, current);
  if (!lines.empty() && move_may_wait()) {
    wait_for_move(out);
  }
  for (const std::string& text : lines) {
    write(may_be_interrupted ? unless_interrupted(text) : text, out);
  }
  limits_known_ = true;
}

void Emitter::restore_shaper(std::string& out) {
  set_shaper(input_.state().shaper, printer_.state().shaper, out);
  tell_shaper(out);
}

// Sets the run's advance if another one is in force, or may be because of a macro.
void Emitter::set_run_advance(std::string& out) {
  const gcode::PressureAdvance& sliced = input_.state().pressure_advance;
  const gcode::PressureAdvance& present = printer_.state().pressure_advance;
  const std::optional<planner::FirmwareAdvance> wanted = advance_in_run(options_, sliced);
  if (!wanted ||
      (advance_known_ && planner::advance_in_force(options_.fixed, present) == *wanted)) {
    return;
  }
  write(advance_line(options_.fixed.firmware,
                     {wanted->advance_s,
                      wanted->smooth_s > 0.0 ? std::optional(wanted->smooth_s) : std::nullopt,
                      sliced.extruder}),
        out);
  advance_known_ = true;
}

// A new smooth time is a stop, so it stays between runs.
void Emitter::restore_advance(bool with_smooth_time, std::string& out) {
  const gcode::PressureAdvance& sliced = input_.state().pressure_advance;
  const auto setting = [&](const gcode::PressureAdvance& of_file) {
    return std::pair{of_file.advance_s.value_or(options_.fixed.pressure_advance_s),
                     of_file.smooth_s.value_or(options_.fixed.pressure_advance_smooth_s)};
  };
  const auto [advance_s, smooth_s] = setting(sliced);
  const auto [present_s, present_smooth_s] = setting(printer_.state().pressure_advance);
  const bool smooths_otherwise = with_smooth_time && present_smooth_s != smooth_s;
  if (smooths_otherwise || present_s != advance_s) {
    write(advance_line(options_.fixed.firmware,
                       {advance_s, smooths_otherwise ? std::optional(smooth_s) : std::nullopt,
                        sliced.extruder}),
          out);
  }
}

// Switches the shaper off, whether the printer's configuration, the file or a macro has switched it
// on.
void Emitter::switch_shaper_off(std::string& out) {
  const gcode::ModalState& state = printer_.state();
  gcode::Shaper current = state.shaper;
  if (gcode::may_come_on(options_.fixed.firmware, input_.state().shaper)) {
    current.unknown = map_axes(std::logical_or{}, current.unknown, state.shaper_touched);
  }
  set_shaper({}, current, out);
}

void Emitter::set_shaper(const gcode::Shaper& wanted, const gcode::Shaper& current,
                         std::string& out) {
  for (const std::string& text : shaper_lines(options_.fixed.firmware, wanted, current)) {
    write(text, out);
  }
}

void Emitter::write_checkpoint(std::string_view words, std::string& out) {
  if (options_.checkpoints) {
    told_shaper_ = words_of_shaper();
    write(fmt::format("{}{}{}", kCheckpointMacro, words, told_shaper_), out);
  }
}

// Writes a checkpoint if a pause from here on would find another shaper than the last one told.
void Emitter::tell_shaper(std::string& out) {
  if (options_.checkpoints && words_of_shaper() != told_shaper_) {
    write_checkpoint("", out);
  }
}

// The words of SET_INPUT_SHAPER that put the printer's own shaper back while it is off.
std::string Emitter::words_of_shaper() const {
  constexpr std::string_view kCommand = "SET_INPUT_SHAPER";
  std::string words;
  for (const std::string& back :
       shaper_lines(options_.fixed.firmware, input_.state().shaper, printer_.state().shaper)) {
    words += back.substr(kCommand.size());
  }
  return words;
}

}  // namespace unflex::emit
