// Compares the filament of a rewritten run with the sliced file's, move by move.
//
// Notation:
//   Q(t), F(t)   filament the sliced and the emitted file have laid since the run's start, mm
//   t_i          end of the i-th move of the sliced file
//
// If a line of the emitted file spans the end of a move, nobody can say how much of the line
// belongs to which move. So Q(t_i) is compared with the interval from F at the start to F at the
// end of the line. Only the distance outside of it counts. If a line ends at t_i, to the tolerance
// δ of the clock, the interval goes from F(t_i − δ) to F(t_i + δ). The error of a move is the
// difference of the distances at its two ends. At the end of the run the interval has no width.
#pragma once

#include <cstddef>
#include <deque>

#include "unflex/verify/reference_path.hpp"

namespace unflex::verify {

class FilamentLedger {
 public:
  // The path must be at the beginning of a section and must outlive the run.
  void begin_run(const ReferencePath& path);
  // A move of the emitted file, starting at time start_s of the path. The path must be known beyond
  // the move's end.
  void play(const planner::PlannedMove& move, double start_s);
  // Ends the run: all its moves are known, in both files.
  void end_run();

  // Filament of the last run, mm.
  [[nodiscard]] double input_mm() const { return q_mm_; }
  [[nodiscard]] double output_mm() const { return f_mm_; }
  // The largest error of one move so far, mm.
  [[nodiscard]] double worst_move_error_mm() const { return worst_mm_; }

 private:
  // The end of a move of the sliced file.
  struct Border {
    double time_s = 0.0;
    double q_mm = 0.0;
    bool reached = false;  // the line at time_s − δ has been played
    double from_f_mm = 0.0;
  };

  void collect_borders();
  void close(double q_mm, double from_f_mm, double to_f_mm);

  const ReferencePath* path_ = nullptr;
  std::size_t next_piece_ = 0;
  std::deque<Border> borders_;
  double q_mm_ = 0.0;
  double f_mm_ = 0.0;
  double last_distance_mm_ = 0.0;
  double worst_mm_ = 0.0;
};

}  // namespace unflex::verify
