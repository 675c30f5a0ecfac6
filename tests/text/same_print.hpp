// Compares the sliced and the emitted text of one print by a machine that shares nothing with the
// code that reads and writes them.
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
  std::map<std::string, double> limits;  // its own limits, named as in Reading::limits
};

// Whether a print already has comments like those that difference() looks for.
[[nodiscard]] bool has_marks(std::string_view gcode);

// The print with a comment after each line that gives the line's number. A comment stays in place,
// so the lines of the emitted text outside of runs can be identified.
[[nodiscard]] std::string numbered(std::string_view gcode);

// The first difference, or an empty text. Outside of its runs the emitted text must have the lines
// of the sliced text, with the machine at equal places, in equal modes and limits, and with as much
// filament laid. Each run must stay near the lines it replaces. Both texts are numbered.
[[nodiscard]] std::string difference(std::string_view sliced, std::string_view emitted,
                                     const Printer& printer);

}  // namespace unflex::testing
