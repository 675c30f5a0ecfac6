// Two texts of one print, the sliced and the emitted one, held against each other by a machine that
// shares nothing with what reads and writes them.
#pragma once

#include <map>
#include <string>
#include <string_view>

#include "text_machine.hpp"

namespace unflex::testing {

// A printer before the print.
struct Printer {
  Firmware firmware = Firmware::klipper;
  TextMachine::Retraction retraction;
  std::map<std::string, double> limits;  // its own, by the names of Reading::limits
};

// True of a print with comments like those that difference() goes by.
[[nodiscard]] bool has_marks(std::string_view gcode);

// The print with a comment behind each line that says which it was. A comment stays where it is, so
// the lines of the emitted text outside of runs can be told.
[[nodiscard]] std::string numbered(std::string_view gcode);

// What is not the same; nothing if the emitted text, outside of its runs, has the lines of the
// sliced one, with the machine in the same place, modes and limits and the same filament laid, and
// each run stays near the lines it stands for. Both texts are numbered.
[[nodiscard]] std::string difference(std::string_view sliced, std::string_view emitted,
                                     const Printer& printer);

}  // namespace unflex::testing
