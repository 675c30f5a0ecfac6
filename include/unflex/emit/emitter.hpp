// The base's motion as G-code that a printer, whose firmware plans everything it reads anew,
// executes as it was meant (docs/firmware.md says why each rule is there).
//
//   T  time a line shall take, s       d  its distance after rounding, mm
//   v  its speed, mm/s                 A  the firmware's acceleration inside a run, mm/s²
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "unflex/core/kinematics.hpp"
#include "unflex/dynamics/base_trajectory.hpp"
#include "unflex/dynamics/flexible_axis.hpp"
#include "unflex/gcode/interpreter.hpp"
#include "unflex/planner/planner.hpp"

namespace unflex::emit {

// The first bytes of every comment line that unflex adds.
inline constexpr std::string_view kComment = ";unflex";

// How far an axis may go.
struct Reach {
  double min_mm = -std::numeric_limits<double>::infinity();
  double max_mm = std::numeric_limits<double>::infinity();
};

// How the base's motion is cut into lines.
struct LineRules {
  dynamics::FlexibleAxis nozzle_x;  // what hangs on the base
  dynamics::FlexibleAxis nozzle_y;
  Reach reach_x;
  Reach reach_y;
  double tolerance_mm = 3e-4;  // of what a line may move the nozzle by
  double min_line_s = 1e-3;    // none is shorter than this …
  double min_line_mm = 0.0;    // … or than this along both X and Y
  int min_steps = 1;           // of the grid; the firmware joins shorter lines to the next
  double max_line_s = 0.05;
  // Between whole steps lines may be as short as min_line_s, but no more than burst_lines begin
  // within any burst_s, those before and after the run counted; 0: no limit.
  int burst_lines = 0;
  double burst_s = 0.1;
  // On either axis from line to line, where lines can be short enough.
  double max_speed_step_mm_s = 30.0;
  // What motors may do: their change of speed by the time between the lines' middles.
  double max_accel_mm_s2 = 20000.0;
  Motors motors;

  // The duration of lines as short as they can be without end.
  [[nodiscard]] double even_line_s() const {
    return burst_lines > 0 ? std::max(min_line_s, burst_s / burst_lines) : min_line_s;
  }
};

struct EmitOptions {
  gcode::InterpreterOptions interpreter;
  planner::Limits printer_limits;  // in force when the file starts
  planner::FirmwareConfig fixed;
  planner::Limits run_limits;     // inside a compensated run
  double line_accel_mm_s2 = 1e6;  // what the firmware then accelerates a line by
  LineRules lines;
  std::string version;  // for the comment at the first run
  // Klipper: UNFLEX_CHECKPOINT is called where a run begins and ends and where the printer's own
  // shaper is back, so that a pause inside the run takes effect at its end (docs/pausing.md).
  bool checkpoints = false;
};

struct Stroke;  // a line to be, see src/emit/strokes.hpp

// What a run finds when it begins and has to fit into.
struct RunStart {
  std::array<double, 3> zero_mm{};  // machine position of X0 Y0 Z0 (G92)
  double speed_factor = 1.0;        // M220
  planner::Limits limits;           // as the input has them

  friend bool operator==(const RunStart&, const RunStart&) = default;
};

[[nodiscard]] RunStart run_start(const gcode::ModalState& state, const planner::Limits& limits);

// A compensated run, or a part of one.
struct Run {
  // The input's lines in the run: moves, and passive and limit lines between them.
  const std::vector<gcode::Event>* events = nullptr;
  // For each event the number of planned moves it became, 0 for lines that do not move.
  const std::vector<std::size_t>* move_counts = nullptr;
  const std::vector<planner::PlannedMove>* moves = nullptr;
  const dynamics::BaseTrajectory* base = nullptr;
  double lead_in_s = 0.0;        // the first move starts this long after the base
  double tolerance_share = 1.0;  // of LineRules::tolerance_mm that its lines may use
  double limits_share = 1.0;     // of LineRules' burst_lines and max_accel_mm_s2 that they may use
  std::vector<double> lines_before_s =
      {};               // begins of the lines just before it, in order, before 0
  int lines_after = 0;  // how many lines begin within LineRules::burst_s after it
  // It goes on from another part: there the last line's end is in X and Y, the nearest to the base
  // that can be written unless known better.
  bool goes_on = false;
  std::optional<std::array<double, 2>> from_mm = {};
  double late_s = 0.0;  // by how much its first line begins late
  // When the next part goes on from it. The base, which moves then, is given some time further.
  std::optional<double> until_s = {};

  [[nodiscard]] double end_s() const { return until_s.value_or(base->duration_s()); }
};

// A run cut into lines, for a certain start. Without lines when its motion is too small for one.
struct RunPlan {
  RunStart start;
  std::array<double, 2> from_mm{};  // where the first line begins
  std::shared_ptr<const std::vector<Stroke>> strokes;

  [[nodiscard]] bool empty() const;
};

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
