// What a file says of its duration, made true again.
#pragma once

#include <string>
#include <string_view>

#include "unflex/core/error.hpp"

namespace unflex::pipeline {

// The lines of a text, the last perhaps without its end, with the durations in M73 and in the
// slicer's comments multiplied by `factor`.
[[nodiscard]] std::string scaled_lines(std::string_view text, double factor);

// The same for a file, in place. Fails if the file cannot be read or written; `name` is what the
// error calls it.
[[nodiscard]] Status retime(const std::string& path, const std::string& name, double factor);

// What writing comes to where a file takes no more.
[[nodiscard]] tl::unexpected<Error> output_failed(const std::string& name);

}  // namespace unflex::pipeline
