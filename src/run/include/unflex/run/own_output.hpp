// Recognises output of unflex itself, which is no sliced print.
#pragma once

#include <cstddef>
#include <istream>
#include <optional>
#include <string>

#include "unflex/core/error.hpp"
#include "unflex/gcode/line.hpp"

namespace unflex::run {

// The error if a file is unflex's own output where a sliced print is needed.
[[nodiscard]] Error compensated_already(const std::string& file, std::size_t line);

// An error if the line is one of the comments that unflex marks its output with, or the mark of a
// print whose places are of joints.
[[nodiscard]] Status check_as_sliced(const gcode::Line& line, const std::string& file);

// The first such line of a file, if there is one. Leaves the stream, which must be seekable, at its
// beginning.
[[nodiscard]] Result<std::optional<std::size_t>> own_line(std::istream& stream,
                                                          const std::string& file);

}  // namespace unflex::run
