// Corrects what a file says about its duration.
#pragma once

#include <string>
#include <string_view>

#include "unflex/core/error.hpp"

namespace unflex::pipeline {

// The text with the durations in M73 and in the slicer's comments multiplied by `factor`. The last
// line may be without its line ending.
[[nodiscard]] std::string scaled_lines(std::string_view text, double factor);

// Corrects a file in place like scaled_lines(). Fails if the file cannot be read or written; `name`
// is what the error calls it.
[[nodiscard]] Status retime(const std::string& path, const std::string& name, double factor);

}  // namespace unflex::pipeline
