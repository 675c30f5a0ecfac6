// Corrects what a file says about its duration.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "unflex/core/error.hpp"
#include "unflex/core/text_store.hpp"
#include "unflex/gcode/time_note.hpp"
#include "unflex/verify/verify.hpp"

namespace unflex::flow {

// The text with the durations in M73 and in the slicer's comments multiplied by `factor`. The last
// line may be without its line ending.
[[nodiscard]] std::string scaled_lines(std::string_view text, double factor);

// A part of the print that is shorter than this says nothing about how much longer it takes.
inline constexpr double kShortest_s = 10.0;

// How many times as long it takes, for a note and the end of the print. The print must last.
[[nodiscard]] gcode::TimeFactors factors_at(const verify::TimeNote& note,
                                            const verify::TimeNote& end);

// Corrects such durations in a file, in place, each by what has been printed before it and what is
// still to come. A line that is not among the notes, which rise, tells of the whole print. Fails if
// the file cannot be read or written; `name` is what the error calls it.
[[nodiscard]] Status retime(TextStore& text, const std::string& name,
                            const std::vector<verify::TimeNote>& notes,
                            const verify::TimeNote& end);

}  // namespace unflex::flow
