// Cuts the input into pieces: runs, parts of long runs, and the lines between runs.
#pragma once

#include <cstddef>
#include <deque>
#include <istream>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "unflex/core/error.hpp"
#include "unflex/emit/run.hpp"
#include "unflex/gcode/extrusion_mode.hpp"
#include "unflex/gcode/feature.hpp"
#include "unflex/gcode/interpreter.hpp"
#include "unflex/gcode/line.hpp"
#include "unflex/planner/planner.hpp"
#include "unflex/run/travel_check.hpp"
#include "unflex/verify/verify.hpp"

namespace unflex::run {

struct Piece {
  // Whether this is a run: compensable moves and the lines between them that do not stop the
  // machine. Its plan goes from rest to rest, since the base has to stand still where it meets kept
  // motion. It has at least one planned move. A long run comes in parts.
  bool is_run = false;
  std::vector<gcode::Event> events;
  std::vector<std::size_t> move_counts;  // for each event, how many of `moves` it became
  // For each event with moves, the kind of feature that it lays according to the slicer.
  std::vector<gcode::FeatureKind> features;
  std::vector<planner::PlannedMove> moves;
  emit::RunStart start;  // only for runs and parts
  // Pressure advance that the file has set when a run begins, or when what is between two runs
  // ends; nullopt: not set.
  gcode::PressureAdvance pressure_advance;
  int tool = 0;               // in use; 0 also where the printer file tells of no tools
  gcode::Position from_mm{};  // where the piece's first move finds the machine
  // Some moves of the run around this part: none before the first part and after the last.
  std::vector<planner::PlannedMove> before;
  std::vector<planner::PlannedMove> after;
  // The run was ended early, or begins, where too many lines without motion stand in a row. The
  // printer does not stop there, so the run keeps its sliced moves.
  bool cut_off = false;

  [[nodiscard]] bool begins_run() const { return is_run && before.empty(); }
  [[nodiscard]] bool ends_run() const { return is_run && after.empty(); }
};

// The reason why a move is kept whose line is not in a run.
[[nodiscard]] std::string_view kept_move_reason(const gcode::Segment& segment, Firmware firmware);

// Counts the event's moves by the reason why they are kept, if they are.
void count_kept_moves(const gcode::Event& event, Firmware firmware,
                      std::map<std::string, std::size_t>& kept);

class PieceReader {
 public:
  PieceReader(std::istream& input, std::string name, gcode::InterpreterOptions interpreter,
              planner::Limits limits, planner::FirmwareConfig fixed,
              verify::TravelLimits travel = {});

  // The next piece; false at the end of the input. An error of kind input when the text cannot be
  // read, was written by unflex, has E in another mode than it says, ends without a single G-code
  // command in it, selects a tool that the interpreter's options do not name, or has a move without
  // end. The former content of the piece is lost, and the
  // storage of its lines is used again.
  [[nodiscard]] Result<bool> next(Piece& piece);

  [[nodiscard]] std::size_t bytes_read() const { return lines_.bytes_read(); }
  // The warning about moves that leave the travel comes once next() has returned false.
  [[nodiscard]] const std::vector<Diagnostic>& warnings() const { return warnings_; }
  [[nodiscard]] const planner::Limits& limits() const { return planner_->limits(); }

 private:
  void recycle(Piece& piece);
  void take_spare(gcode::Event& event);
  Result<bool> cut(Piece& piece);
  Result<bool> read_event(gcode::Event& event);
  void read_line(gcode::Event& event);
  void warn(std::size_t line, std::string message);
  void warn_of_travel();
  void warn_of_long_moves(const std::vector<planner::PlannedMove>& moves);
  void append(gcode::Event&& event);
  void append_between();
  void mark_border(const gcode::Event& event);
  [[nodiscard]] std::optional<std::size_t> border_to_split_at() const;
  bool split(Piece& piece);
  void close(Piece& piece);

  gcode::LineReader lines_;
  gcode::Interpreter interpreter_;
  std::optional<gcode::Line> approached_;  // line that comes after its approach
  std::unique_ptr<planner::Planner> planner_;
  Firmware firmware_;
  TravelCheck travel_;
  // A place before a move where a run that turns out to be long may be split.
  struct Border {
    std::size_t event = 0;
    std::size_t move = 0;
    emit::RunStart start;
  };

  Piece open_;                    // piece being filled
  std::deque<Border> borders_;    // borders in open_
  double since_border_s_ = 0.0;   // rough time since the last border
  gcode::Position machine_mm_{};  // end of the last planned move
  std::size_t borders_since_look_ = 0;
  std::vector<std::vector<gcode::Event>> spare_;  // storage for the next events
  std::size_t spare_events_ = 0;                  // number of events in spare_
  std::vector<gcode::Event>
      between_;                  // lines after the open run's last move, perhaps not in the run
  bool after_cut_ = false;       // only lines without motion since a run was cut off
  std::size_t still_lines_ = 0;  // lines without motion in the open run and after it
  std::vector<Diagnostic> warnings_;
  std::size_t unlisted_warnings_ = 0;
  gcode::FeatureKind feature_ = gcode::FeatureKind::other;  // that the slicer named last
  bool any_command_ = false;
  int tool_ = 0;
  gcode::ExtrusionModeCheck extrusion_mode_;
};

}  // namespace unflex::run
