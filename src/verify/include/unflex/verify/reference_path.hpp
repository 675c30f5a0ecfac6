// The planned moves of the sliced file on one time axis. Only the moves needed now are held.
//
// Time starts at 0 with the first move of the file and runs through all moves and rests. Sections
// (runs and single moves that are kept as they are) follow each other without a gap.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "unflex/core/xy.hpp"
#include "unflex/planner/planner.hpp"

namespace unflex::verify {

// A move of this duration that stands still.
[[nodiscard]] planner::PlannedMove resting(const XY& place_mm, double duration_s);

// The time at which the reference has covered this length of a move.
struct Passage {
  double time_s = 0.0;      // since the move began
  double covered_mm = 0.0;  // of its length
};

// A move of the path, and the timing in which the reference passes it.
struct ReferenceMove {
  planner::PlannedMove move;
  // The timing from the move's beginning to its end, at even speed between two passages. Empty: the
  // move's own timing.
  std::vector<Passage> timing;

  [[nodiscard]] double duration_s() const {
    return timing.empty() ? move.duration_s() : timing.back().time_s;
  }
};

// Hands out the next move of a section; false at the section's end.
using MoveSource = std::function<bool(ReferenceMove&)>;

struct PathPiece {
  double start_s = 0.0;
  double end_s = 0.0;
  XY start_mm;
  XY direction;  // unit vector, or 0 0
  double length_xy_mm = 0.0;
  bool measured = false;  // deviations count here
  bool extruding = false;
  double filament_mm = 0.0;  // filament that extruding pieces have laid before this one
  std::size_t section = 0;   // number of its section
  planner::PlannedMove move;
  std::vector<Passage> timing;  // as in ReferenceMove

  // Length of the XY path the move has covered at time t, in [0, length_xy_mm].
  [[nodiscard]] double covered_xy_mm(double t) const;
  // The part of `timing`, which is not empty, that is passed at time t: it ends with this passage.
  [[nodiscard]] std::size_t passage_after(double t) const;
};

class ReferencePath {
 public:
  explicit ReferencePath(MoveSource source) : source_(std::move(source)) {}

  // Starts the next section where the last one ended; its first move begins lead_in_s later.
  void begin_section(double lead_in_s = 0.0);
  [[nodiscard]] double section_start_s() const { return section_start_s_; }
  // Number of the current section.
  [[nodiscard]] std::size_t section() const { return section_; }

  // Pulls moves until the path reaches beyond t or the section ends. References to pieces do not
  // survive this.
  void extend_to(double t);
  // Whether all moves of the section are known.
  [[nodiscard]] bool section_complete() const { return section_complete_; }
  // Time at which the known part ends, s.
  [[nodiscard]] double end_s() const { return end_s_; }
  // Filament that all extruding pieces so far lay.
  [[nodiscard]] double filament_mm() const { return filament_mm_; }

  // The machine stands still between two sections. Nothing is measured.
  void rest(double duration_s) { end_s_ += duration_s; }
  // The machine stands still, but deviations count, as after the end of the file.
  void hold(const XY& place_mm, double duration_s);

  // Pieces have numbers that stay the same when old ones are dropped.
  [[nodiscard]] std::size_t first() const { return dropped_; }
  [[nodiscard]] std::size_t end() const { return dropped_ + pieces_.size(); }
  [[nodiscard]] const PathPiece& operator[](std::size_t number) const {
    return pieces_[number - dropped_];
  }

  // Forgets pieces that end before t.
  void discard_before(double t);

 private:
  void append(ReferenceMove reference, bool measured);

  MoveSource source_;
  std::vector<PathPiece> pieces_;
  std::size_t dropped_ = 0;
  double end_s_ = 0.0;
  double filament_mm_ = 0.0;
  double section_start_s_ = 0.0;
  std::size_t section_ = 0;
  bool section_complete_ = false;
};

}  // namespace unflex::verify
