// Changes lines of a file in place.
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "unflex/core/error.hpp"

namespace unflex::pipeline {

// Appends to `out` what shall stand in the place of `text`, which is whole lines. Only the file's
// last line may lack its ending.
using LineChange = std::function<void(std::string_view text, std::string& out)>;

// Hands the file's text to `change`, block by block in order, and writes what it makes of it over
// the text. What the text grows by is held in memory. Fails if the file cannot be read or written;
// `name` is what the error calls it.
[[nodiscard]] Status rewrite_lines(const std::string& path, const std::string& name,
                                   const LineChange& change);

// The error if a file cannot be written any further.
[[nodiscard]] tl::unexpected<Error> output_failed(const std::string& name);

}  // namespace unflex::pipeline
