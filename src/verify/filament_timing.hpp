// The timing of a run that need not last as long as sliced: the reference is at the place of the
// sliced path whose filament comes out.
//
// Notation:
//   Q_j    filament that the sliced moves before the j-th have laid since the run began, mm
//   F(t)   filament that the emitted file has laid at time t
//
// Moves that lay filament, or draw it back, are passed when F is between Q_j and Q_{j+1}. Along
// moves without filament, the reference has covered the same share of the sliced path as the base
// has covered of its own.
#pragma once

#include <cstddef>
#include <deque>
#include <functional>
#include <optional>
#include <vector>

#include "unflex/planner/planner.hpp"
#include "unflex/verify/reference_path.hpp"

namespace unflex::verify {

class FilamentTiming {
 public:
  using Moves = std::function<bool(planner::PlannedMove&)>;

  // Both hand out the moves of the run at hand; false at its end.
  FilamentTiming(Moves sliced, Moves emitted)
      : sliced_source_(std::move(sliced)), emitted_source_(std::move(emitted)) {}

  // A run begins. What is known of the last one is forgotten. tolerance_mm: by how much filament
  // may be rounded. left_behind_mm: how much of it may be missing where travel begins.
  void begin(double tolerance_mm, double left_behind_mm);
  // The next sliced move, with its timing; false at the end of the run. What the emitted file never
  // reaches is passed as sliced.
  [[nodiscard]] bool next(ReferenceMove& move);

 private:
  enum class Kind { lays, draws_back, travels };

  // A line of the emitted file from when it may still matter.
  struct Line {
    planner::PlannedMove move;
    double begin_s = 0.0;
    double filament_mm = 0.0;  // F when it begins
    double length_mm = 0.0;    // of the base's path when it begins
  };

  // A moment of the emitted file.
  struct Moment {
    double time_s = 0.0;
    double filament_mm = 0.0;
    double length_mm = 0.0;
  };

  void read_sliced();
  static Kind kind_of(const planner::PlannedMove& move);
  [[nodiscard]] bool pull();
  [[nodiscard]] Moment moment(const Line& line, double share) const;
  [[nodiscard]] Moment end_of(const Line& line) const { return moment(line, 1.0); }
  void time_by_filament(Kind kind);
  void time_travel();
  void forget_lines();

  Moves sliced_source_;
  Moves emitted_source_;
  double tolerance_mm_ = 0.0;
  double left_behind_mm_ = 0.0;
  std::optional<planner::PlannedMove> next_sliced_;
  std::deque<ReferenceMove> timed_;  // to be handed out
  std::deque<Line> lines_;           // of the emitted file, the first one holds `now_`
  Moment now_;                       // when the last timed move ends
  double sliced_filament_mm_ = 0.0;  // Q where it ends
  Moment pulled_;                    // the end of the last line
  bool sliced_ended_ = false;
  bool emitted_ended_ = false;
};

}  // namespace unflex::verify
