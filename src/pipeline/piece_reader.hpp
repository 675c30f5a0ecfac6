// The input cut into what is handled as one: runs, and the lines between them.
#pragma once

#include <cstddef>
#include <deque>
#include <istream>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "extrusion_mode.hpp"
#include "unflex/core/error.hpp"
#include "unflex/emit/run.hpp"
#include "unflex/gcode/interpreter.hpp"
#include "unflex/gcode/line.hpp"
#include "unflex/planner/planner.hpp"
#include "unflex/verify/verify.hpp"

namespace unflex::pipeline {

struct Piece {
  // A run: compensable moves and the lines between them that do not stop the machine. Its plan goes
  // from rest to rest, since the base has to stand still where it meets motion left as it is. Has
  // at least one planned move. A long one comes in parts.
  bool is_run = false;
  std::vector<gcode::Event> events;
  std::vector<std::size_t> move_counts;  // for each event, how many of `moves` it became
  std::vector<planner::PlannedMove> moves;
  emit::RunStart start;  // of a run
  // Where a run begins: what the file has set, if it has.
  std::optional<double> pressure_advance_s;
  gcode::Position from_mm{};  // where the piece's first move finds the machine
  // Of a part of a run, some of its moves around: none before the first part and after the last.
  std::vector<planner::PlannedMove> before;
  std::vector<planner::PlannedMove> after;
  // Of a run: it meets another one where the machine does not stop, but for the lines without
  // motion there, which are too many to be held. Its own moves have to stand.
  bool cut_off = false;

  [[nodiscard]] bool begins_run() const { return is_run && before.empty(); }
  [[nodiscard]] bool ends_run() const { return is_run && after.empty(); }
};

// Why a move of a line that is no part of a run stays as it is.
[[nodiscard]] std::string_view kept_move_reason(const gcode::Segment& segment, Firmware firmware);

// Counts the event's moves that unflex leaves as they are, by reason.
void count_kept_moves(const gcode::Event& event, Firmware firmware,
                      std::map<std::string, std::size_t>& kept);

class PieceReader {
 public:
  PieceReader(std::istream& input, std::string name, gcode::InterpreterOptions interpreter,
              planner::Limits limits, planner::FirmwareConfig fixed,
              verify::TravelLimits travel = {});

  // The next piece; false at the end of the input. An error of kind input when the text cannot be
  // read, was written by unflex, has E in another mode than it says, ends without a single G-code
  // command in it, or has a move without end. What the piece held before is gone; the storage of
  // its lines is used again.
  [[nodiscard]] Result<bool> next(Piece& piece);

  [[nodiscard]] std::size_t bytes_read() const { return lines_.bytes_read(); }
  [[nodiscard]] const std::vector<Diagnostic>& warnings() const { return warnings_; }
  [[nodiscard]] const planner::Limits& limits() const { return planner_->limits(); }

 private:
  void recycle(Piece& piece);
  void take_spare(gcode::Event& event);
  Result<bool> cut(Piece& piece);
  Result<bool> read_event(gcode::Event& event);
  void read_line(gcode::Event& event);
  void warn(std::size_t line, std::string message);
  void warn_of_travel(const gcode::Event& event);
  void append(gcode::Event&& event);
  void append_between();
  void mark_border(const gcode::Event& event);
  [[nodiscard]] std::optional<std::size_t> border_to_split_at() const;
  bool split(Piece& piece);
  void close(Piece& piece);

  gcode::LineReader lines_;
  gcode::Interpreter interpreter_;
  std::optional<gcode::Line> approached_;  // read, and to come after gcode::Interpreter::approach
  std::unique_ptr<planner::Planner> planner_;
  Firmware firmware_;
  verify::TravelLimits travel_;
  // Where a run that turns out to be long may be parted: before a move of it.
  struct Border {
    std::size_t event = 0;
    std::size_t move = 0;
    emit::RunStart start;
  };

  Piece open_;                    // being filled
  std::deque<Border> borders_;    // of it
  double since_border_s_ = 0.0;   // roughly
  gcode::Position machine_mm_{};  // after the last planned move
  std::size_t borders_since_look_ = 0;
  std::vector<std::vector<gcode::Event>> spare_;  // storage for the next ones
  std::size_t spare_events_ = 0;                  // in it
  std::vector<gcode::Event> between_;  // after the open run's last move; its own or not, who knows
  bool after_cut_ = false;             // and nothing but lines without motion since
  std::size_t still_lines_ = 0;        // without motion, of the open run and after it
  std::vector<Diagnostic> warnings_;
  std::size_t unlisted_warnings_ = 0;
  bool any_command_ = false;
  ExtrusionModeCheck extrusion_mode_;
};

}  // namespace unflex::pipeline
