// What a printer makes of a text.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "unflex/gcode/interpreter.hpp"
#include "unflex/planner/planner.hpp"

namespace unflex::fuzz {

// A segment and the limits in force when it was given to the planner.
struct Given {
  gcode::Segment segment;
  planner::Limits limits;
};

struct Playback {
  std::vector<gcode::Event> events;
  std::vector<Given> given;
  std::vector<planner::PlannedMove> moves;
  gcode::ModalState end;
  planner::Limits limits;  // at the end
  std::string text;        // all lines that were read
  std::size_t warnings = 0;
  bool whole = true;  // read to its end
};

struct PrinterSetup {
  gcode::InterpreterOptions interpreter;
  planner::Limits limits;
  planner::FirmwareConfig fixed;
};

// Plays the text until there are `most_segments` of motion. Checks conditions that every line must
// meet.
[[nodiscard]] Playback play(const std::string& text, const PrinterSetup& setup,
                            std::size_t most_segments);

}  // namespace unflex::fuzz
