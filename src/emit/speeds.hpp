// The speeds of the lines of a run.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "strokes.hpp"

namespace unflex::emit {

// The base's velocity where the lines begin and end; unset: it rests.
struct Passing {
  std::optional<XY> in_mm_s;
  std::optional<XY> out_mm_s;
  // The motion before a run, if the machine does not stop between the two.
  std::optional<gcode::Segment> kept_before = {};
};

// Sets the speeds of the strokes, and the digits of F they need, so that the firmware takes the
// time that each of them was given. late_s: how late the first line begins; the lines make up for
// it.
void set_speeds(const gcode::Position& start_mm, const Passing& passing, const EmitOptions& options,
                const Grid& grid, double late_s, std::vector<Stroke>& strokes);

}  // namespace unflex::emit
