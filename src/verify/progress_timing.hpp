// The timing of a run that need not last as long as sliced, by the progress of the emitted file on
// the sliced path.
//
// Notation:
//   s      place on the sliced path, as its length from the run's beginning on, mm
//   Q(s)   filament that the sliced file lays up to there
//   F(t)   filament that the emitted file has laid at time t
//   b(t)   base
//
// After each line of the emitted file s goes forward to where Q agrees with F. Q may agree on a
// whole stretch, where nothing is laid, or where filament is laid in coarse steps. On such a
// stretch s is the place nearest to the base.
#pragma once

#include <cstddef>
#include <deque>
#include <functional>
#include <vector>

#include "unflex/planner/planner.hpp"
#include "unflex/verify/reference_path.hpp"

namespace unflex::verify {

class ProgressTiming {
 public:
  using Moves = std::function<bool(planner::PlannedMove&)>;

  // Both give the next move of the run at hand; false at its end.
  ProgressTiming(Moves sliced, Moves emitted)
      : sliced_source_(std::move(sliced)), emitted_source_(std::move(emitted)) {}

  // Begins a run and forgets the last one. rounding_mm: by how much F may be off in the end.
  void begin(double rounding_mm);
  // The next sliced move, with its timing; false at the end of the run. What the emitted file never
  // reaches is passed as sliced.
  [[nodiscard]] bool next(ReferenceMove& move);

 private:
  // A sliced move that has not been handed out.
  struct Sliced {
    ReferenceMove reference;
    double begin_mm = 0.0;     // s
    double length_mm = 0.0;    // in X and Y
    double filament_mm = 0.0;  // Q where it begins
    double begin_s = 0.0;      // when it is reached, once it is
  };
  // A place on a sliced move.
  struct Place {
    std::size_t move = 0;
    double along_mm = 0.0;
  };

  bool read_sliced();
  [[nodiscard]] bool has_move(std::size_t number);
  [[nodiscard]] double filament_at(const Place& place) const;
  [[nodiscard]] bool agrees(double filament_mm) const;
  [[nodiscard]] Place first_agreeing(Place from);
  [[nodiscard]] Place nearest(Place from, const gcode::Position& base_mm, double expected_mm);
  [[nodiscard]] double s_of(const Place& place) const {
    return sliced_[place.move].begin_mm + place.along_mm;
  }
  void go_to(const Place& place, double time_s);
  void follow(const planner::PlannedMove& line);
  void pass_as_sliced();

  Moves sliced_source_;
  Moves emitted_source_;
  double rounding_mm_ = 0.0;
  std::deque<Sliced> sliced_;  // the first one holds at_
  std::deque<ReferenceMove> passed_;
  Place at_;              // where the emitted file has come
  double time_s_ = 0.0;   // when
  double laid_mm_ = 0.0;  // F
  double end_mm_ = 0.0;   // s and Q at the end of what has been read
  double end_filament_mm_ = 0.0;
  bool sliced_ended_ = false;
  bool emitted_ended_ = false;
};

}  // namespace unflex::verify
