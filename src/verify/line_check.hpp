// Checks that the lines of the sliced file stand in the emitted one: all, unchanged, in their
// order, where they stood along the path, and none but lines of known forms between them. Blank
// lines are ignored.
#pragma once

#include "ahead_check.hpp"
#include "replay.hpp"
#include "violations.hpp"

namespace unflex::verify {

// Whether the lines are equal byte for byte, except for durations in M73 and comments, and for the
// line ending. A missing line ending may have been added. A line ending of Windows may have become
// the short one, as binary G-code has it.
[[nodiscard]] bool same_line(const gcode::Line& input, const gcode::Line& output);

class LineCheck {
 public:
  LineCheck(Replay& input, Replay& output, Violations& violations, bool may_ask_ahead)
      : input_(&input),
        output_(&output),
        violations_(&violations),
        ahead_(input.firmware(), may_ask_ahead) {}

  // Compares and removes the lines of the current run that both files have read. complete: both
  // have read all of it, so that a line left over on one side is an error. In a compensated run a
  // line may stand up to place_tolerance_mm from its place.
  void compare(bool complete, double place_tolerance_mm);

  // Passes a section that both files have here. A line that was asked for ahead must not pass every
  // section.
  void pass(const Section& input, const Section& output);

 private:
  [[nodiscard]] PlacedLine* front(Replay& file) const;
  [[nodiscard]] bool at_same_place(const PlacedLine& input, const PlacedLine& output) const;
  void compare(const PlacedLine& input, const PlacedLine& output);
  void match(const PlacedLine& input, const PlacedLine& output);
  void resynchronise(const PlacedLine& output);
  void lost(const PlacedLine& input);
  void unknown(const PlacedLine& output);
  void pass(const gcode::Line& line, bool loses_place, std::size_t output_line);

  Replay* input_;
  Replay* output_;
  double place_tolerance_mm_ = 0.0;
  Violations* violations_;
  AheadCheck ahead_;
};

}  // namespace unflex::verify
