#include "time_notes.hpp"

#include <algorithm>

#include "unflex/gcode/time_note.hpp"

namespace unflex::verify {

void TimeNotes::read(const gcode::Line& line) {
  if (gcode::tells_time(line.content())) {
    waiting_.push_back(line.number);
  }
}

void TimeNotes::play(std::size_t line, double time_s) {
  for (; !waiting_.empty() && waiting_.front() < line; waiting_.pop_front()) {
    placed_.push_back({waiting_.front(), time_s});
  }
}

std::vector<TimeNote> time_notes(const TimeNotes& input, const TimeNotes& output) {
  std::vector<TimeNote> notes;
  const std::size_t count = std::min(input.placed().size(), output.placed().size());
  for (std::size_t i = 0; i < count; ++i) {
    notes.push_back({output.placed()[i].line, input.placed()[i].time_s, output.placed()[i].time_s});
  }
  return notes;
}

}  // namespace unflex::verify
