// A file as the firmware sees it: planned moves, cut into sections, and the other lines, each with
// the place where it stands.
//
// A run section is a stretch of motion that may be rewritten; sections of the other kinds are
// single lines that end it. Runs (possibly empty) and other sections alternate, beginning with a
// run:
//
//   run | barrier | run | retraction | run | Z move | run | … | end
#pragma once

#include <cstddef>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "plan_queue.hpp"
#include "unflex/core/xy.hpp"
#include "unflex/gcode/interpreter.hpp"
#include "unflex/gcode/line.hpp"
#include "unflex/planner/planner.hpp"

namespace unflex::verify {

// The mode a line is read in and the limits in force there.
struct Regime {
  gcode::ModalState modal;
  planner::Limits limits;
};

enum class SectionKind {
  run,
  move,     // a move that is kept as it is
  border,   // a line without motion that no run reaches across: the label of an object …
  barrier,  // the machine stops: homing, tool change, macro, pause …
  end,      // end of the file
};

struct Section {
  SectionKind kind = SectionKind::run;
  std::size_t id = 0;
  // The section's line; runs have none.
  gcode::Line line;
  std::optional<Regime> regime;  // before the line; run: before its first move; end: the final one
  // Pressure advance that the file has set when the section begins. For a run that was joined over
  // barriers: when its last part begins. nullopt: as the printer's configuration has it.
  gcode::PressureAdvance advance;
  // The tool in use before the section: that of the last line that selects one. 0: none has yet.
  int tool = 0;
  double dwell_s = 0.0;
  // barrier: for how long the machine stands still to switch its shaper or pressure advance.
  double switching_s = 0.0;
  bool moves_by_itself = false;  // barrier: the machine moves by itself
  // barrier: not a line of the sliced file, but an Interpreter::approach that is read with it.
  bool is_approach = false;
  // barrier: its form is one that unflex adds, so the sliced file may not have this barrier.
  bool may_be_added = false;
  // run: whether it is announced as compensated, by how much its base begins before its plan, and
  // whether it may last longer or shorter than that plan.
  bool compensated = false;
  double lead_in_s = 0.0;
  bool has_free_timing = false;
};

// A line that is no section, and where the machine is when it comes.
struct PlacedLine {
  gcode::Line line;
  XY place_mm;
  double pushed_mm = 0.0;  // filament pushed so far, without what was drawn back
  bool motion = false;     // G0 to G3 with an axis or E
  std::size_t section = 0;
};

// Whether unflex adds lines of this form to a file.
[[nodiscard]] bool is_known_addition(std::string_view content, Firmware firmware);

enum class ReplayedFile {
  sliced,
  sliced_with_approaches,  // reads an Interpreter::approach before each line that has one
  emitted,  // runs may be announced as compensated, which is ignored in a sliced file; there is no
            // resting plan
};

class Replay {
 public:
  Replay(std::istream& stream, std::string name, const gcode::InterpreterOptions& interpreter,
         const planner::Limits& limits, const planner::FirmwareConfig& fixed, ReplayedFile file);

  // Calls `listener` with every line, before the line is interpreted.
  void on_line(std::function<void(const gcode::Line&)> listener) {
    listener_ = std::move(listener);
  }

  // The next move of the current section; false at its end.
  [[nodiscard]] bool next(planner::PlannedMove& move);
  // Whether next() would give a move. Every line before that move has then been read.
  [[nodiscard]] bool has_move();
  // The move that next() would give. has_move() must hold.
  [[nodiscard]] const planner::PlannedMove& front() const { return plan_.front(); }
  [[nodiscard]] Firmware firmware() const { return fixed_.firmware; }
  // The next move of the sliced file by the resting plan, in which the machine rests at both ends
  // of every section; false at the section's end. The two plans are independent. Moves of the
  // resting plan that nobody takes are dropped at the section's end or by skip_resting().
  [[nodiscard]] bool next_resting(planner::PlannedMove& move);
  void skip_resting() { resting_plan_.skip(); }

  // The current section. `compensated` and `regime` of a run are known once has_move() was asked.
  [[nodiscard]] const Section& section() const { return sections_.front(); }
  // Filament per mm of E, by M221 and M200: the larger value of where the current section began and
  // of the last line read.
  [[nodiscard]] double filament_factor() const;
  // The section after the current one. All moves of the current one must have been taken.
  [[nodiscard]] const Section& following() const { return sections_[1]; }
  void next_section();
  // Joins the current run, the barrier after it and the run after that barrier to one run.
  void join_over_barrier();

  // Lines read so far, oldest first. The caller removes the lines it has dealt with.
  [[nodiscard]] std::deque<PlacedLine>& lines() { return lines_; }

  [[nodiscard]] const gcode::LineReader& reader() const { return reader_; }
  [[nodiscard]] std::size_t lines_read() const { return lines_read_; }
  // Set when the file could not be read to its end; the sections then stop there.
  [[nodiscard]] const std::optional<Error>& error() const { return error_; }

 private:
  [[nodiscard]] bool find_move(const PlanQueue& plan);
  void read_line();
  void end_file(const Regime& before);
  void read_approach(const gcode::Line& line);
  void read_event(gcode::Event event, const Regime& before);
  void understand(gcode::Event event, const Regime& before);
  void read_run_moves(gcode::Event event, const Regime& before);
  void read_section(SectionKind kind, gcode::Event event, const Regime& before);
  void place(gcode::Line line, const Regime& before, bool motion);
  // Calls action with each plan that is kept.
  template <class Action>
  void for_each_plan(Action action) {
    action(plan_);
    if (!is_emitted()) {
      action(resting_plan_);
    }
  }
  void push_section(Section section);
  [[nodiscard]] bool is_emitted() const { return file_ == ReplayedFile::emitted; }
  [[nodiscard]] bool stays_in_run(const gcode::Event& event) const;

  gcode::LineReader reader_;
  gcode::Interpreter interpreter_;
  PlanQueue plan_;          // as it is carried out
  PlanQueue resting_plan_;  // as it is planned, which runs follow
  planner::FirmwareConfig fixed_;
  std::function<void(const gcode::Line&)> listener_;
  ReplayedFile file_;
  bool in_compensated_run_ = false;  // between the lines that announce its begin and its end
  bool at_end_ = false;
  std::optional<Error> error_;
  std::size_t lines_read_ = 0;
  int tool_ = 0;
  double pushed_mm_ = 0.0;
  std::deque<Section> sections_;  // from the current one to the one being read
  std::deque<PlacedLine> lines_;
};

}  // namespace unflex::verify
