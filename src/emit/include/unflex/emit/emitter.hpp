// Writes the base's motion as G-code. Firmware plans anew everything that it reads. The text is
// written so that the printer still executes the intended motion. docs/firmware.md gives the reason
// for each rule.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "unflex/emit/emit_options.hpp"
#include "unflex/emit/run.hpp"
#include "unflex/gcode/interpreter.hpp"
#include "unflex/planner/planner.hpp"

namespace unflex::emit {

// The costly part of writing a run; it does not depend on what is written before.
[[nodiscard]] RunPlan plan_run(const Run& run, const RunStart& start, const EmitOptions& options);

// The lines of `plan` with new speeds, for a run whose Run::late_s has changed.
[[nodiscard]] RunPlan retimed(const RunPlan& plan, const Run& run, const EmitOptions& options);

// Whether the line is homing, a macro or a tool change. These move the machine by themselves and
// may leave other limits. Before them the printer gets its own shaper back, which is off from the
// first run on.
[[nodiscard]] bool moves_by_itself(const gcode::Event& event);

// Writes the output in the order of the input. Follows both texts with an interpreter of its own,
// so that whatever stands outside the runs finds the modes, positions and limits the input left
// there. Copyable: a copy tries a run, and is kept or thrown away.
class Emitter {
 public:
  explicit Emitter(EmitOptions options);

  // Writes an input line outside of compensated runs, byte for byte, after whatever has to be
  // restored before it.
  void line(const gcode::Event& event, std::string& out);

  // Writes the lines of a run that is kept. The printer's own shaper stays as it is, on before the
  // first run and off after it, because each switch is a stop.
  void keep(const std::vector<gcode::Event>& events, std::string& out);

  // The state that a run which follows now would start from.
  [[nodiscard]] RunStart run_start() const;

  // Writes a compensated run in place of its events. The plan must not be empty and must be made
  // for run_start(). The parts of a run must follow each other directly.
  void run(const Run& run, const RunPlan& plan, std::string& out);

  // To be called after the last line.
  void finish(std::string& out);

  // The words to type after the print, if the printer's own shaper is off and not known:
  // "SHAPER_FREQ_X=... SHAPER_FREQ_Y=...". Empty if there is nothing to type.
  [[nodiscard]] std::string shaper_left_off() const;

  // The printer's state after the output so far.
  [[nodiscard]] const gcode::Interpreter& printer() const { return printer_; }
  [[nodiscard]] const planner::Limits& printer_limits() const { return limits_; }

 private:
  void write(std::string_view text, std::string& out);     // a line of ours
  void copy(const gcode::Event& event, std::string& out);  // a line of the input
  void note_motion(const gcode::Event& event);
  void follow_input(const gcode::Event& event);
  void sign(std::string& out);
  void enter_run(const Run& run, std::string& out);
  void set_run_modes(const Run& run, bool joins_file, std::string& out);
  [[nodiscard]] bool e_is_known() const;
  void set_filament_factor(double flow_factor, bool volumetric, std::string& out);
  void keep_reading_of_e_within(double most_mm, std::string& out);
  void set_unit(double unit_mm, std::string& out);
  [[nodiscard]] bool move_may_wait() const;
  void wait_for_move(std::string& out);
  void write_stroke(const Stroke& stroke, double filament_origin, std::string& out);
  void restore_modes(std::string& out);
  void write_feed(double feed_mm_s, std::string& out);
  void restore_shaper(std::string& out);
  void set_limits(const planner::Limits& limits, std::string& out, bool may_be_interrupted = false);
  void switch_shaper_off(std::string& out);
  void set_run_advance(std::string& out);
  void restore_advance(bool with_smooth_time, std::string& out);
  void set_shaper(const gcode::Shaper& wanted, const gcode::Shaper& current, std::string& out);
  void write_checkpoint(std::string_view words, std::string& out);
  void tell_shaper(std::string& out);
  [[nodiscard]] std::string words_of_shaper() const;

  EmitOptions options_;
  gcode::Interpreter input_;      // has read the input so far
  gcode::Interpreter printer_;    // has read the output so far
  planner::Limits input_limits_;  // as the input has them
  planner::Limits limits_;        // as the output has them
  bool limits_known_ = true;      // false if a macro may have changed limits_
  bool advance_known_ = true;     // false if a macro may have set pressure advance
  bool signed_ = false;           // the line that names the version has been written
  bool move_waits_ = false;       // limits written next may hold for the last move as well
  bool moving_ = false;           // the last line moves X or Y, so the next may begin at speed
  std::string told_shaper_;       // the words of the last checkpoint that put the shaper back
  std::string newline_ = "\n";    // as the input has it
  bool open_line_ = false;        // the last line written has no line ending
};

}  // namespace unflex::emit
