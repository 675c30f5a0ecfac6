// From the vertices of a run's lines to its strokes.
#pragma once

#include <cstddef>
#include <vector>

#include "speeds.hpp"
#include "step_path.hpp"
#include "strokes.hpp"
#include "timetable.hpp"

namespace unflex::emit {

// Strokes that have neither filament nor speeds yet.
struct BareStrokes {
  std::vector<Stroke> strokes;
  std::vector<double> ends_s;  // when each of them ends in the run's own time
  std::size_t laying = 0;  // lines that lay the run's filament; lines of the tail come after them
};

// How lines take changes of Z.
struct Climb {
  double steepest = 0.0;  // the largest slope of a line
  // Share of the line's time that ramps may take. F makes up for them, so F changes more than the
  // speed does.
  double ramps = 0.0;
  double waits_mm = 0.0;  // a change that is smaller may wait for other lines
};

// moves_in_z: whether the base moves in Z to make up for modes.
[[nodiscard]] Climb climb_of(bool moves_in_z);

// Cuts the strokes from vertex to vertex, and merges those that would have no length. from: where
// the machine stands. end: where the last stroke ends.
[[nodiscard]] BareStrokes cut_strokes(const Timetable& table, const Polygon& vertices,
                                      const std::vector<double>& event_times_s, const Grid& grid,
                                      const LineRules& rules, const EmitOptions& options,
                                      const Stroke& from, const gcode::Position& end,
                                      const Passing& ends);

// The run must end at its height. If the last line cannot take all of its change of Z, the lines
// before it take the rest. `after`: the velocity behind the last line.
void climb_in_time(const Stroke& start, XY after, const Climb& climb, const Grid& grid,
                   const EmitOptions& options, std::vector<Stroke>& strokes);

}  // namespace unflex::emit
