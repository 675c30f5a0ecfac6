// The base's motion as G-code that a printer, whose firmware plans everything it reads anew,
// executes as it was meant (docs/firmware.md says why each rule is there).
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

// The same lines for a run that begins later or less late.
[[nodiscard]] RunPlan retimed(const RunPlan& plan, const Run& run, const EmitOptions& options);

// Homing, macros and tool changes, which move the machine by themselves and may leave other limits.
// Before them the printer gets its own shaper back, which is off from the first run on.
[[nodiscard]] bool moves_by_itself(const gcode::Event& event);

// Writes the output in the order of the input. Follows both texts with an interpreter of its own,
// so that whatever stands outside the runs finds the modes, positions and limits the input left
// there. Copyable: a copy tries a run, and is kept or thrown away.
class Emitter {
 public:
  explicit Emitter(EmitOptions options);

  // An input line outside of compensated runs, byte for byte, with whatever has to be restored
  // before it.
  void line(const gcode::Event& event, std::string& out);

  // Lines that were to be a compensated run but stand as they are. The printer's own shaper stays
  // as it is, on before the first run and off after it: each switch is a stop.
  void keep(const std::vector<gcode::Event>& events, std::string& out);

  // What a run that follows now would start from.
  [[nodiscard]] RunStart run_start() const;

  // A compensated run in place of its events. The plan is not empty and made for run_start(). Of a
  // run in parts, all have to follow each other.
  void run(const Run& run, const RunPlan& plan, std::string& out);

  // After the last line.
  void finish(std::string& out);

  // The output's state so far, as the printer has it.
  [[nodiscard]] const gcode::Interpreter& printer() const { return printer_; }
  [[nodiscard]] const planner::Limits& printer_limits() const { return limits_; }

 private:
  void write(std::string_view text, std::string& out);     // a line of ours
  void copy(const gcode::Event& event, std::string& out);  // a line of the input
  void note_motion(const gcode::Event& event);
  void follow_input(const gcode::Event& event);
  void enter_run(std::string& out);
  void set_run_modes(bool joins_file, std::string& out);
  void keep_reading_of_e_small(std::string& out);
  void set_unit(double unit_mm, std::string& out);
  void write_stroke(const Stroke& stroke, double filament_origin, std::string& out);
  void restore_modes(std::string& out);
  void restore_shaper(std::string& out);
  void set_limits(const planner::Limits& limits, std::string& out);
  void set_shaper(const gcode::Shaper& wanted, std::string& out);
  void write_checkpoint(std::string_view words, std::string& out);
  void tell_shaper(std::string& out);
  [[nodiscard]] std::string words_of_shaper() const;

  EmitOptions options_;
  gcode::Interpreter input_;      // has read the input so far
  gcode::Interpreter printer_;    // has read the output so far
  planner::Limits input_limits_;  // as the input has them
  planner::Limits limits_;        // as the output has them …
  bool limits_known_ = true;      // … unless a macro may have changed them
  bool started_ = false;          // a run has been written
  bool moving_ = false;           // the last line moves X or Y; what follows may pass on at speed
  std::string told_shaper_;       // what the last checkpoint says that puts the shaper back
  std::string newline_ = "\n";    // as the input has it
  bool open_line_ = false;        // the last line written has no line ending
};

}  // namespace unflex::emit
