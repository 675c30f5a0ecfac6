// What unflex wrote itself is no sliced print.
#pragma once

#include <string>

#include "unflex/core/error.hpp"
#include "unflex/gcode/line.hpp"

namespace unflex::pipeline {

// An error if the line is one of the comments that unflex marks its output with.
[[nodiscard]] Status check_as_sliced(const gcode::Line& line, const std::string& file);

}  // namespace unflex::pipeline
