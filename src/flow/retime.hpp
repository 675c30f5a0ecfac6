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

// The factors by which durations grow, for a note in a print that ends at `end`. The print must
// last.
[[nodiscard]] gcode::TimeFactors factors_at(const verify::TimeNote& note,
                                            const verify::TimeNote& end);

// Corrects the durations in a file, in place: those in M73 and in the slicer's comments. Each is
// corrected by the part of the print before it and the part still to come. A line that is not among
// the notes, which rise, tells of the whole print. Fails if the file cannot be read or written;
// `name` is the file's name in the error.
[[nodiscard]] Status retime(TextStore& text, const std::string& name,
                            const std::vector<verify::TimeNote>& notes,
                            const verify::TimeNote& end);

}  // namespace unflex::flow
