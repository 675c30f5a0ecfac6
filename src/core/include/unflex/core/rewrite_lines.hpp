// Changes lines of a file in place.
#pragma once

#include <string>

#include "unflex/core/error.hpp"
#include "unflex/core/text_store.hpp"

namespace unflex {

// Calls TextStore::rewrite() and makes its failure an error, which calls the text `name`.
[[nodiscard]] Status rewrite_lines(TextStore& text, const std::string& name,
                                   const LineChange& change);

// The error if a file cannot be written any further.
[[nodiscard]] tl::unexpected<Error> output_failed(const std::string& name);

}  // namespace unflex
