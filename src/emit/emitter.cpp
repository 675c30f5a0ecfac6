#include "unflex/emit/emitter.hpp"

#include <fmt/core.h>

#include <cctype>
#include <cmath>
#include <utility>

#include "dialect.hpp"
#include "filament.hpp"
#include "strokes.hpp"
#include "unflex/core/firmware_spec.hpp"
#include "unflex/core/number.hpp"
#include "unflex/core/own_marks.hpp"
#include "unflex/gcode/compensable.hpp"

namespace unflex::emit {
namespace {

using gcode::E;
using gcode::X;
using gcode::Y;
using gcode::Z;

constexpr int kPositionDecimals = 4;
constexpr int kExactDecimals = 9;           // where a run ends on a finer place than the grid
constexpr double kFeedToleranceMmS = 1e-6;  // F restored with its decimals may be off by this

bool same(double a, double b) { return std::abs(a - b) < 1e-9; }

void append_word(std::string& text, char letter, double value, int decimals) {
  text += ' ';
  text += letter;
  append_scaled(text, to_scaled(value, decimals), decimals);
}

// With the grid's decimals if the value lies on the grid, else with kExactDecimals.
void append_coordinate(std::string& text, char letter, double value) {
  const double on_grid =
      static_cast<double>(to_scaled(value, kPositionDecimals)) / power_of_ten(kPositionDecimals);
  append_word(text, letter, value, same(on_grid, value) ? kPositionDecimals : kExactDecimals);
}

// Leaves out the zero before the point, as slicers do: most lines lay less than a millimetre.
void append_filament(std::string& text, double value) {
  append_word(text, 'E', value, kFilamentDecimals);
  const std::size_t point = text.find('.', text.rfind('E'));
  if (point != std::string::npos && text[point - 1] == '0' && !std::isdigit(text[point - 2])) {
    text.erase(point - 1, 1);
  }
}

// The places that an axis can have: those that can be written, or whole steps if the firmware
// rounds to steps.
AxisGrid axis_grid(const planner::FirmwareConfig& config, gcode::Axis axis, double zero_mm) {
  if (spec_of(config.firmware).motion.rounds_to_steps) {
    return {0.0, 1.0 / config.steps_per_mm[axis]};
  }
  return {zero_mm, 1.0 / power_of_ten(kPositionDecimals)};
}

Grid grid_of(const RunStart& start, const planner::FirmwareConfig& config) {
  const auto grid = [&](gcode::Axis axis) { return axis_grid(config, axis, start.zero_mm[axis]); };
  return {{grid(X), grid(Y)}, grid(Z), start.speed_factor, start.zeroes_e};
}

bool changes(const gcode::Event& event, const planner::Limits& limits) {
  planner::Limits changed = limits;
  planner::apply(*event.limits, changed);
  return changed != limits;
}

// The firmware's limits in the run, with `file` as the input has them.
planner::Limits run_limits(const Run& run, const planner::Limits& file,
                           const EmitOptions& options) {
  return limits_in_run(options.fixed.firmware, file,
                       raised(options.run_limits, run.accel.lines_mm_s2));
}

EmitOptions in_run(const Run& run, const RunStart& start, EmitOptions options) {
  options.lines.max_accel_mm_s2 = std::max(options.lines.max_accel_mm_s2, run.accel.base_mm_s2);
  options.line_accel_mm_s2 = std::max(options.line_accel_mm_s2, run.accel.lines_mm_s2);
  options.run_limits = run_limits(run, start.limits, options);
  options.pressure.hotend = hotend_of(options, start.advance);
  options.run_advance = advance_in_run(options, start.advance);
  return options;
}

}  // namespace

Emitter::Emitter(EmitOptions options)
    : options_(std::move(options)),
      input_(options_.interpreter),
      printer_(options_.interpreter),
      input_limits_(options_.printer_limits),
      limits_(options_.printer_limits) {}

void Emitter::write(std::string_view text, std::string& out) {
  if (open_line_) {
    // The input's last line has no line ending.
    out += newline_;
    open_line_ = false;
  }
  const std::size_t begin = out.size();
  out += text;
  out += newline_;
  const gcode::Event event = printer_.interpret({out.substr(begin), 0});
  planner::apply(*event.limits, limits_);
  note_motion(event);
}

void Emitter::note_motion(const gcode::Event& event) {
  if (!event.segments.empty()) {
    moving_ = event.segments.back().length_xy_mm() > 0.0;
    move_waits_ = true;
  } else if (event.kind == gcode::EventKind::barrier) {
    moving_ = false;
    // A pause waits for standstill. Of other barriers it is not known, and a macro may move last.
    move_waits_ = moves_by_itself(event) || (move_waits_ && event.dwell_s <= 0.0);
  }
}

void Emitter::copy(const gcode::Event& event, std::string& out) {
  out += event.line.text;
  open_line_ = !event.line.text.ends_with('\n');
  newline_ = event.line.text.ends_with("\r\n") ? "\r\n" : "\n";
  const gcode::Event read = printer_.interpret(event.line);
  planner::apply(*read.limits, limits_);
  limits_known_ = limits_known_ && !event.may_set_limits;
  advance_known_ = advance_known_ && !event.position_lost;
  note_motion(read);
}

void Emitter::follow_input(const gcode::Event& event) {
  static_cast<void>(input_.interpret(event.line));
  planner::apply(*event.limits, input_limits_);
}

void Emitter::line(const gcode::Event& event, std::string& out) {
  if (event.added) {
    sign(out);
  }
  const bool lays = !event.segments.empty() && event.segments.front().extruding();
  if (moves_by_itself(event)) {
    restore_shaper(out);
    limits_known_ = false;
  }
  if (lays || moves_by_itself(event)) {
    restore_advance(moves_by_itself(event), out);
  }
  copy(event, out);
  follow_input(event);
  if (event.kind == gcode::EventKind::border || event.kind == gcode::EventKind::barrier) {
    // RESTORE_GCODE_STATE brings back what was saved, which is not always what the input has now.
    restore_modes(out);
  }
  tell_shaper(out);
}

void Emitter::keep(const std::vector<gcode::Event>& events, std::string& out) {
  for (const gcode::Event& event : events) {
    line(event, out);
  }
}

bool moves_by_itself(const gcode::Event& event) { return event.position_lost; }

RunStart run_start(Firmware firmware, const gcode::ModalState& state,
                   const planner::Limits& limits) {
  return {{state.base_mm[X], state.base_mm[Y], state.base_mm[Z]},
          state.speed_factor,
          limits,
          spec_of(firmware).reading.sums_e_in_single_precision && state.known[E],
          state.pressure_advance};
}

bool RunPlan::empty() const { return strokes == nullptr || strokes->empty(); }

RunPlan plan_run(const Run& run, const RunStart& start, const EmitOptions& options) {
  const Grid grid = grid_of(start, options.fixed);
  return {
      start, start_of_lines(run, grid),
      std::make_shared<const std::vector<Stroke>>(strokes(run, grid, in_run(run, start, options)))};
}

RunPlan retimed(const RunPlan& plan, const Run& run, const EmitOptions& options) {
  std::vector<Stroke> strokes = *plan.strokes;
  time_strokes(run, grid_of(plan.start, options.fixed), in_run(run, plan.start, options), strokes);
  return {plan.start, plan.from_mm,
          std::make_shared<const std::vector<Stroke>>(std::move(strokes))};
}

RunStart Emitter::run_start() const {
  RunStart start = emit::run_start(options_.fixed.firmware, printer_.state(), input_limits_);
  start.zeroes_e = start.zeroes_e && e_is_known();
  start.advance = input_.state().pressure_advance;
  return start;
}

void Emitter::run(const Run& run, const RunPlan& plan, std::string& out) {
  const double filament_origin = input_.state().position_mm[E];
  if (!run.goes_on) {
    enter_run(run, out);
  }
  std::size_t written = 0;
  const auto write_events = [&](std::size_t end) {
    for (; written < end; ++written) {
      const gcode::Event& event = (*run.events)[written];
      // Moves are replaced, even those without length, since the base is not at the place that they
      // name.
      const bool stays =
          event.kind != gcode::EventKind::move && !gcode::names_position(event.line.content());
      if (stays && spec_of(options_.fixed.firmware).writing.units_scale_all_words) {
        set_unit(input_.state().unit_mm, out);
      }
      if (stays && move_may_wait() && changes(event, limits_)) {
        wait_for_move(out);
      }
      follow_input(event);
      if (stays) {
        copy(event, out);
      }
    }
  };
  bool joins_file = !run.goes_on;  // the first line follows the file's own motion
  for (const Stroke& stroke : *plan.strokes) {
    write_events(stroke.events);
    set_run_modes(run, std::exchange(joins_file, false), out);
    const bool is_first = &stroke == &plan.strokes->front();
    keep_reading_of_e_within(is_first ? 0.0 : kMostReadingOfE_mm, out);
    write_stroke(stroke, filament_origin, out);
  }
  // The remaining lines belong to the run too, even if its motion is over.
  write_events(run.events->size());
  if (run.until_s) {
    return;
  }
  write(kRunEndMark, out);
  set_unit(1.0, out);
  set_limits(input_limits_, out);
  restore_modes(out);
  write_checkpoint("", out);
}

void Emitter::finish(std::string& out) {
  restore_shaper(out);
  restore_advance(true, out);
  if (const std::string words = shaper_left_off(); !words.empty()) {
    write(fmt::format("{}: the printer's own input shaper is not known and still off; set it again "
                      "as its configuration has it: {}",
                      kOwnMark, words),
          out);
  }
}

std::string Emitter::shaper_left_off() const {
  return unknown_shaper_lines(options_.fixed.firmware, input_.state().shaper,
                              printer_.state().shaper);
}

// Before the first line that is not the sliced file's.
void Emitter::sign(std::string& out) {
  if (!std::exchange(signed_, true)) {
    write(fmt::format("{} {}: compensated for {}, not to be compensated again", kOwnMark,
                      options_.version, spec_of(options_.fixed.firmware).brand),
          out);
  }
}

void Emitter::enter_run(const Run& run, std::string& out) {
  sign(out);
  switch_shaper_off(out);
  set_run_advance(out);
  if (moving_) {
    // A run begins at rest, but no firmware stops by itself between the move before it and its
    // first line. G4 without a time makes all three firmwares end their motion and go on at once.
    write("G4 P0", out);
    move_waits_ = false;
  }
  write_checkpoint(" RUN=1", out);
  write(fmt::format("{}{}{}", kRunMark,
                    run.lead_in_s > 0.0 ? fmt::format("{}{:.6f}", kLeadInWord, run.lead_in_s) : "",
                    options_.has_free_timing ? kFreeTimingWord : ""),
        out);
}

// Sets a run's modes and limits, since the input's lines inside the run may have set others.
void Emitter::set_run_modes(const Run& run, bool joins_file, std::string& out) {
  set_unit(1.0, out);
  planner::Limits limits = run_limits(run, input_limits_, options_);
  if (joins_file) {
    // When a move is added, RepRapFirmware joins it to the previous move by the jerk policy in
    // force at that time, and may still change the previous move. With the policy of a run,
    // filament moved alone before the run would end at the speed of the run's first line, and stop
    // dead.
    limits.jerk_policy = input_limits_.jerk_policy;
  }
  // A run that is interrupted before its first line still begins at rest.
  set_limits(limits, out, options_.checkpoints && !joins_file);
  const gcode::ModalState& state = printer_.state();
  if (!state.absolute_xyz) {
    write("G90", out);
  }
  if (state.absolute_e) {
    write("M83", out);
  }
  if (spec_of(options_.fixed.firmware).writing.scales_whole_steps_of_e &&
      (!input_.state().absolute_e || e_is_known())) {
    // A run's lines have so few steps that a factor near one would have no effect. So E is filament
    // as it is laid, and the difference of readings is put right when the run ends.
    set_filament_factor(1.0, false, out);
  }
}

bool Emitter::e_is_known() const { return input_.state().known[E] && printer_.state().known[E]; }

// M221 and M200. `volumetric`: E is a volume.
void Emitter::set_filament_factor(double flow_factor, bool volumetric, std::string& out) {
  constexpr double kPercent = 100.0;
  const gcode::ModalState& state = printer_.state();
  if (state.flow_factor != flow_factor) {
    write(fmt::format("M221 S{:.0f}", flow_factor * kPercent), out);
  }
  if (state.volumetric != volumetric) {
    write(volumetric ? fmt::format("M200 D{}", input_.state().filament_diameter_mm / state.unit_mm)
                     : "M200 D0",
          out);
  }
}

// Acts only if the file's own reading of E is known, since it has to be put back after the run. A
// part begins with a reading of 0, since Marlin rounds what E reads to whole steps, and which line
// has a step decides how X and Y turn back (planner.cpp, _populate_block).
void Emitter::keep_reading_of_e_within(double most_mm, std::string& out) {
  const gcode::ModalState& state = printer_.state();
  if (run_start().zeroes_e && std::abs(state.e_reading()) > most_mm) {
    write("G92 E0", out);
  }
}

// Sets the unit of moves. Marlin reads limits, M200 and M207 in this unit as well.
void Emitter::set_unit(double unit_mm, std::string& out) {
  if (printer_.state().unit_mm != unit_mm) {
    write(unit_mm == 1.0 ? "G21" : "G20", out);
  }
}

void Emitter::write_stroke(const Stroke& stroke, double filament_origin, std::string& out) {
  const gcode::ModalState& state = printer_.state();
  std::string text = "G1";
  const auto axis = [&](gcode::Axis a, char letter, double position) {
    if (!same(position, state.position_mm[a])) {
      append_coordinate(text, letter, position - state.base_mm[a]);
    }
  };
  axis(X, 'X', stroke.place_mm.x);
  axis(Y, 'Y', stroke.place_mm.y);
  if (state.known[Z]) {
    // If the height is unknown, the run's moves do not change it.
    axis(Z, 'Z', stroke.z_mm);
  }
  // The difference includes what rounding has left over so far.
  const double filament =
      (filament_origin + stroke.e_mm - state.position_mm[E]) / state.filament_per_e_mm();
  if (to_scaled(filament, kFilamentDecimals) != 0) {
    append_filament(text, filament);
  }
  append_word(text, 'F', stroke.speed_mm_s * 60.0 / state.speed_factor, stroke.feed_decimals);
  write(text, out);
}

void Emitter::restore_modes(std::string& out) {
  const gcode::ModalState& wanted = input_.state();
  const gcode::ModalState& state = printer_.state();
  set_filament_factor(wanted.flow_factor, wanted.volumetric, out);
  // A G92 E of the input may have stood at a moment inside one of our lines. Its zero is put right
  // here. If a macro has left an unknown reading of E, nothing is done, since the next E would be
  // measured from a wrong zero.
  if (wanted.known[E] && !same(wanted.base_mm[E], state.base_mm[E])) {
    std::string text = "G92";
    append_word(text, 'E', (state.position_mm[E] - wanted.base_mm[E]) / state.filament_per_e_mm(),
                9);
    write(text, out);
  }
  // Before M82 and M83: Marlin's G90 and G91 set the mode of E as well.
  if (wanted.absolute_xyz != state.absolute_xyz) {
    write(wanted.absolute_xyz ? "G90" : "G91", out);
  }
  if (wanted.absolute_e != state.absolute_e) {
    write(wanted.absolute_e ? "M82" : "M83", out);
  }
  set_unit(wanted.unit_mm, out);
  if (std::abs(wanted.feed_mm_s - state.feed_mm_s) > kFeedToleranceMmS) {
    write_feed(wanted.feed_mm_s, out);
  }
}

void Emitter::write_feed(double feed_mm_s, std::string& out) {
  std::string text = "G1";
  append_word(text, 'F', feed_mm_s * 60.0 / printer_.state().unit_mm, kExactDecimals);
  write(text, out);
  move_waits_ = false;
}

}  // namespace unflex::emit
