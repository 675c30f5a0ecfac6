// The times at which the lines come that tell how long the print takes.
#pragma once

#include <cstddef>
#include <deque>
#include <vector>

#include "unflex/gcode/line.hpp"
#include "unflex/verify/verify.hpp"

namespace unflex::verify {

// The lines of one file.
class TimeNotes {
 public:
  struct Placed {
    std::size_t line = 0;
    double time_s = 0.0;
  };

  // Reads a line, before the moves behind it are played.
  void read(const gcode::Line& line);
  // A move of that line begins.
  void play(std::size_t line, double time_s);

  // The lines behind which a move has come.
  [[nodiscard]] const std::vector<Placed>& placed() const { return placed_; }

 private:
  std::deque<std::size_t> waiting_;
  std::vector<Placed> placed_;
};

// The lines of both files, which have the same ones in the same order.
[[nodiscard]] std::vector<TimeNote> time_notes(const TimeNotes& input, const TimeNotes& output);

}  // namespace unflex::verify
